// SPDX-License-Identifier: BSD-3-Clause
// Where the links and the contact points of a robot are, for pictures.
#include <limits>

#include "contact_flow/model/rigid_body/kinematics.h"
#include "convert.h"
#include "robot.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

/// The link that each link hangs on; −1: the world. Links of one body hang on its first one, that
/// one on the first link of the nearest body before it that has links.
std::vector<int> Parents(const RobotModel& model) {
  std::vector<int> first(static_cast<std::size_t>(model.tree.num_bodies()), -1), parents;
  for (std::size_t k = 0; k < model.links.size(); ++k) {
    int body = model.links[k].body, parent = -1;
    if (body >= 0 && first[static_cast<std::size_t>(body)] < 0) {
      first[static_cast<std::size_t>(body)] = static_cast<int>(k);
      body = model.tree.bodies()[static_cast<std::size_t>(body)].parent;
    }
    for (; body >= 0 && parent < 0;
         body = model.tree.bodies()[static_cast<std::size_t>(body)].parent) {
      parent = first[static_cast<std::size_t>(body)];
    }
    parents.push_back(parent == static_cast<int>(k) ? -1 : parent);
  }
  return parents;
}

Vec3<double> InWorld(const TreeState<double>& state, int body, const Vec3<double>& local) {
  if (body < 0) return local;
  const auto& pose = state.body[static_cast<std::size_t>(body)];
  return pose.position + pose.rotation * local;
}

/// place(state, k) of `count` points at q [nq] as [count×3], at each row of Q as [rows×count×3].
template <class Place>
py::array_t<double> Points(const Robot& robot, const py::handle& q, std::size_t count,
                           Place&& place) {
  const RigidBodyTree& tree = robot.robot().model.tree;
  const Array numbers = ToArray(q, "q");
  const bool many = numbers.ndim() == 2;
  const py::ssize_t nq = tree.num_positions(), points = static_cast<py::ssize_t>(count);
  if (numbers.ndim() < 1 || numbers.ndim() > 2 || numbers.shape(numbers.ndim() - 1) != nq) {
    throw py::value_error("q has not " + std::to_string(nq) + " numbers, or rows of them: " +
                          Join(robot.description().coordinates));
  }
  const py::ssize_t rows = many ? numbers.shape(0) : 1;
  py::array_t<double> found(many ? std::vector<py::ssize_t>{rows, points, 3}
                                 : std::vector<py::ssize_t>{points, 3});
  double* out = found.mutable_data();
  TreeState<double> state(tree);
  for (py::ssize_t row = 0; row < rows; ++row) {
    UpdatePositions(tree, numbers.data() + row * nq, &state);
    for (std::size_t k = 0; k < count; ++k, out += 3) {
      Eigen::Map<Vec3<double>>(out, 3) = place(state, k);
    }
  }
  return found;
}

py::array_t<double> LinkPositions(const Robot& robot, const py::object& q) {
  const auto& links = robot.robot().model.links;
  return Points(robot, q, links.size(), [&](const TreeState<double>& state, std::size_t k) {
    return InWorld(state, links[k].body, links[k].pose.position);
  });
}

py::array_t<double> ContactPoints(const Robot& robot, const py::object& q) {
  const auto& all = robot.robot().constraints;
  return Points(robot, q, all.size(), [&](const TreeState<double>& state, std::size_t k) {
    const auto& points = all[k]->parts.points;
    if (points.empty()) {
      return Vec3<double>(Vec3<double>::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
    return InWorld(state, points.front().body, points.front().local);
  });
}

}  // namespace

void BindRobotPose(py::module_* module) {
  py::class_<Robot, System, std::shared_ptr<Robot>>(module->attr("Robot"))
      .def_property_readonly(
          "links",
          [](const Robot& robot) {
            py::list names;
            for (const auto& link : robot.robot().model.links) names.append(link.name);
            return py::tuple(names);
          },
          "Names of the links [L].")
      .def_property_readonly(
          "link_parents", [](const Robot& robot) { return Parents(robot.robot().model); },
          "Index of the link that each one hangs on; −1: the world [L].")
      .def(
          "link_positions", &LinkPositions, py::arg("q"),
          "Origins of the links in the world [L×3]; of each row of an array [k×nq] as [k×L×3] [m].")
      .def("contact_points", &ContactPoints, py::arg("q"),
           "The point of each contact in the world (of a sphere its centre) [n×3]; NaN for those "
           "that\n"
           "have none, as joint limits [m].");
}

}  // namespace python
}  // namespace contact_flow
