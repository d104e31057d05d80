// SPDX-License-Identifier: BSD-3-Clause
#include "test/model/rigid_body/mujoco_model.h"

#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace contact_flow {
namespace {

std::string Text(const Vec3<double>& v) {
  std::ostringstream text;
  text.precision(17);
  text << v(0) << ' ' << v(1) << ' ' << v(2);
  return text.str();
}
std::string Text(const Mat3<double>& R) {
  const Eigen::Quaterniond q(R);
  std::ostringstream text;
  text.precision(17);
  text << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z();
  return text.str();
}

std::string JointXml(const char* type, int number, const Pose& frame, int axis) {
  return "<joint type=\"" + std::string(type) + "\" name=\"j" + std::to_string(number) +
         "\" pos=\"" + Text(frame.position) + "\" axis=\"" +
         Text(Vec3<double>(frame.rotation.col(axis))) + "\"/>";
}

}  // namespace

MujocoModel::MujocoModel(const RigidBodyTree& tree, const std::string& extra,
                         const std::vector<std::string>& inside)
    : tree_(tree),
      children_(tree.num_bodies()),
      body_(tree.num_bodies()),
      frame_(tree.num_bodies()),
      merged_(tree.num_bodies()) {
  std::string world;
  for (int i = 0; i < tree.num_bodies(); ++i) {
    if (tree.bodies()[i].parent >= 0) children_[tree.bodies()[i].parent].push_back(i);
  }
  for (int i = 0; i < tree.num_bodies(); ++i) {
    if (tree.bodies()[i].parent < 0) world += Body(i, inside);
  }
  const std::string xml = "<mujoco><compiler angle=\"radian\"/><option gravity=\"" +
                          Text(tree.gravity()) + "\"/>" + extra + "<worldbody>" +
                          (inside.empty() ? "" : inside.back()) + world + "</worldbody></mujoco>";
  const std::string path = "/tmp/contact_flow_mujoco_" + std::to_string(getpid()) + ".xml";
  std::ofstream(path) << xml;
  char error[1000] = "";
  model = mj_loadXML(path.c_str(), nullptr, error, sizeof(error));
  std::remove(path.c_str());
  if (model == nullptr) throw std::runtime_error(error);
  ours_.assign(model->nv, -1);
  for (int i = 0; i < tree.num_bodies(); ++i) {
    const RigidBodyTree::Body& body = tree.bodies()[i];
    for (int k = 0; k < body.num_dofs; ++k) {
      const bool ball = body.joint == JointKind::kBall;
      const std::string name = "j" + std::to_string(ball ? body.v : body.v + k);
      const int joint = mj_name2id(model, mjOBJ_JOINT, name.c_str());
      ours_[model->jnt_dofadr[joint] + (ball ? k : 0)] = body.v + k;
    }
    int carrier = i;  // the body of theirs that this one is part of
    while (merged_[carrier]) carrier = children_[carrier][0];
    body_[i] = mj_name2id(model, mjOBJ_BODY, ("b" + std::to_string(carrier)).c_str());
    if (merged_[i]) continue;
    // The XML has a stand-in for inertias, which may be zero here.
    const Eigen::SelfAdjointEigenSolver<Mat3<double>> eigen(
        Mat3<double>(frame_[i].rotation * body.inertia.central * frame_[i].rotation.transpose()));
    Mat3<double> axes = eigen.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    const Eigen::Quaterniond turn(axes);
    const Vec3<double> com = frame_[i] * body.inertia.com;
    const int b = body_[i];
    model->body_mass[b] = body.inertia.mass;
    const double quaternion[] = {turn.w(), turn.x(), turn.y(), turn.z()};
    for (int k = 0; k < 4; ++k) model->body_iquat[4 * b + k] = quaternion[k];
    for (int k = 0; k < 3; ++k) {
      model->body_ipos[3 * b + k] = com(k);
      model->body_inertia[3 * b + k] = eigen.eigenvalues()(k);
    }
    model->body_sameframe[b] = 0;
  }
  // Shortcuts that were taken for the stand-ins.
  for (int k = 0; k < model->nv; ++k) model->dof_simplenum[k] = 0;
  for (int k = 0; k < model->nbody; ++k) model->body_simple[k] = 0;
  data = mj_makeData(model);
}

MujocoModel::~MujocoModel() {
  mj_deleteData(data);
  mj_deleteModel(model);
}

std::string MujocoModel::Body(int i, const std::vector<std::string>& inside) {
  const Pose parent = tree_.bodies()[i].parent < 0 ? Pose() : frame_[tree_.bodies()[i].parent];
  const Pose place = parent * tree_.bodies()[i].placement;
  std::string joints;
  Pose frame;
  while (true) {
    const RigidBodyTree::Body& body = tree_.bodies()[i];
    frame_[i] = frame;
    switch (body.joint) {
      case JointKind::kRevolute:
        joints += JointXml("hinge", body.v, frame, 2);
        break;
      case JointKind::kPrismatic:
        joints += JointXml("slide", body.v, frame, 2);
        break;
      case JointKind::kTranslation:
        for (int k = 0; k < 3; ++k) joints += JointXml("slide", body.v + k, frame, k);
        break;
      case JointKind::kBall:
        if (!frame.rotation.isIdentity(1e-15)) throw std::logic_error("a ball must be aligned");
        joints += JointXml("ball", body.v, frame, 2);
        break;
    }
    if (body.inertia.mass > 0) break;
    if (children_[i].size() != 1) throw std::logic_error("a body without mass must carry one");
    merged_[i] = true;
    i = children_[i][0];
    frame = frame * tree_.bodies()[i].placement;
  }
  std::string xml = "<body name=\"b" + std::to_string(i) + "\" pos=\"" + Text(place.position) +
                    "\" quat=\"" + Text(place.rotation) + "\">" + joints +
                    "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
  if (i < static_cast<int>(inside.size()) - 1) xml += inside[i];
  for (const int child : children_[i]) xml += Body(child, inside);
  return xml + "</body>";
}

void MujocoModel::SetState(const Vector& q, const Vector& v) {
  for (const RigidBodyTree::Body& body : tree_.bodies()) {
    const bool ball = body.joint == JointKind::kBall;
    for (int k = 0; k < (ball ? 4 : body.num_dofs); ++k) {
      const std::string name = "j" + std::to_string(ball ? body.v : body.v + k);
      const int joint = mj_name2id(model, mjOBJ_JOINT, name.c_str());
      data->qpos[model->jnt_qposadr[joint] + (ball ? k : 0)] = q(body.q + k);
    }
  }
  for (int k = 0; k < model->nv; ++k) data->qvel[k] = v(ours_[k]);
}

}  // namespace contact_flow
