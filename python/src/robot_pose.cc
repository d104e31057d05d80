// SPDX-License-Identifier: BSD-3-Clause
// Where the links, contacts and the terrain of a robot are, for pictures.
#include <cmath>
#include <limits>

#include "contact_flow/io/mesh_file.h"
#include "contact_flow/model/rigid_body/contact_place.h"
#include "contact_flow/model/rigid_body/kinematics.h"
#include "contact_flow/model/rigid_body/terrain_surface.h"
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

/// Rows of a matrix, or one row.
Array RowsOf(const py::handle& rows, const char* name, py::ssize_t cols, const std::string& names) {
  const Array numbers = ToArray(rows, name);
  if (numbers.ndim() < 1 || numbers.ndim() > 2 || numbers.shape(numbers.ndim() - 1) != cols) {
    throw py::value_error(std::string(name) + " has not " + std::to_string(cols) +
                          " numbers, or rows of them: " + names);
  }
  return numbers;
}

/// place(state, k, row, out) fills `shape` numbers of each of `count` things at q [nq], or at each
/// row of q: [count×shape] or [rows×count×shape].
template <class Place>
py::array_t<double> Fill(const Robot& robot, const py::handle& q, std::size_t count,
                         const std::vector<py::ssize_t>& shape, Place&& place) {
  const RigidBodyTree& tree = robot.robot().model.tree;
  const py::ssize_t nq = tree.num_positions();
  const Array numbers = RowsOf(q, "q", nq, Join(robot.description().coordinates));
  const bool many = numbers.ndim() == 2;
  const py::ssize_t rows = many ? numbers.shape(0) : 1;
  std::vector<py::ssize_t> sizes;
  if (many) sizes.push_back(rows);
  sizes.push_back(static_cast<py::ssize_t>(count));
  py::ssize_t step = 1;
  for (const py::ssize_t size : shape) {
    sizes.push_back(size);
    step *= size;
  }
  py::array_t<double> found(sizes);
  double* out = found.mutable_data();
  TreeState<double> state(tree);
  for (py::ssize_t row = 0; row < rows; ++row) {
    UpdatePositions(tree, numbers.data() + row * nq, &state);
    for (std::size_t k = 0; k < count; ++k, out += step) place(state, k, row, out);
  }
  return found;
}

/// The same of points: place(state, k).
template <class Place>
py::array_t<double> Points(const Robot& robot, const py::handle& q, std::size_t count,
                           Place&& place) {
  return Fill(robot, q, count, {3},
              [&](const TreeState<double>& state, std::size_t k, py::ssize_t, double* out) {
                Eigen::Map<Vec3<double>>(out, 3) = place(state, k);
              });
}

py::array_t<double> LinkPositions(const Robot& robot, const py::object& q) {
  const auto& links = robot.robot().model.links;
  return Points(robot, q, links.size(), [&](const TreeState<double>& state, std::size_t k) {
    return InWorld(state, links[k].body, links[k].pose.position);
  });
}

py::array_t<double> LinkRotations(const Robot& robot, const py::object& q) {
  const auto& links = robot.robot().model.links;
  return Fill(robot, q, links.size(), {3, 3},
              [&](const TreeState<double>& state, std::size_t k, py::ssize_t, double* out) {
                const RobotModel::Link& link = links[k];
                Mat3<double> rotation = link.pose.rotation;
                if (link.body >= 0) {
                  rotation = state.body[static_cast<std::size_t>(link.body)].rotation * rotation;
                }
                Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out, 3, 3) = rotation;
              });
}

/// The points and forces of all contacts, one after the other: [n×2×3] or [rows×n×2×3].
py::array_t<double> ContactForces(const Robot& robot, const py::object& q,
                                  const py::object& force) {
  const RobotSystem& system = robot.robot_system();
  const py::ssize_t all = system.num_rows();
  const Array lambda = RowsOf(force, "force", all, "those of Run.force");
  const Array numbers = ToArray(q, "q");
  const bool many = lambda.ndim() == 2;
  if (lambda.ndim() != numbers.ndim() || (many && lambda.shape(0) != numbers.shape(0))) {
    throw py::value_error("q and force have not the same number of rows");
  }
  return Fill(robot, q, robot.robot().constraints.size(), {2, 3},
              [&](const TreeState<double>& state, std::size_t k, py::ssize_t row, double* out) {
                Vec3<double> point, push;
                const Eigen::Map<const Vector> own(lambda.data() + row * all, all);
                PlaceContact(system, static_cast<int>(k), state, own, &point, &push);
                Eigen::Map<Vec3<double>>(out, 3) = point;
                Eigen::Map<Vec3<double>>(out + 3, 3) = push;
              });
}

py::list Terrain(const Robot& robot, const py::object& near, double half_width, int tiles,
                 double time) {
  const Array place = ToArray(near, "near");
  if (place.ndim() != 1 || place.shape(0) != 3) throw py::value_error("near has not 3 numbers");
  if (!(half_width > 0) || !std::isfinite(half_width)) {
    throw py::value_error("half_width " + Number(half_width) + " is not positive");
  }
  if (tiles < 1 || tiles > 1000) {
    throw py::value_error("tiles " + std::to_string(tiles) + " is not 1 to 1000");
  }
  py::list found;
  const Vec3<double> at(place.data()[0], place.data()[1], place.data()[2]);
  const double tile = 2 * half_width / tiles;
  for (const TerrainPiece& piece : TerrainNear(robot.robot(), at)) {
    const Vec3<double> moved = TerrainDisplacement(robot.robot(), piece.constraint, time, 2 * tile);
    py::array_t<double> corners(std::vector<py::ssize_t>{tiles + 1, tiles + 1, 3});
    double* out = corners.mutable_data();
    for (int i = 0; i <= tiles; ++i) {
      for (int j = 0; j <= tiles; ++j, out += 3) {
        Eigen::Map<Vec3<double>>(out, 3) =
            moved + piece.surface(i * tile - half_width, j * tile - half_width);
      }
    }
    found.append(corners);
  }
  return found;
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
      .def("link_rotations", &LinkRotations, py::arg("q"),
           "Axes of the links in the world, as columns [L×3×3]; of each row of an array [k×nq] as\n"
           "[k×L×3×3].")
      .def("contact_forces", &ContactForces, py::arg("q"), py::arg("force"),
           "Where each contact touches [m] and the force on the robot there [N], that of friction\n"
           "with it, for λ as of Run.force: [n×2×3], or for rows of both [k×n×2×3]. Of a limit:\n"
           "its joint, no force.")
      .def("terrain", &Terrain, py::arg("near"), py::arg("half_width") = 2.0, py::arg("tiles") = 20,
           py::arg("time") = 0.0,
           "The surfaces of the world that it touches, each once, near a point [3]: corners of\n"
           "square tiles [tiles+1×tiles+1×3] each [m], where they are at a time [s]; planes that\n"
           "move along themselves by a tile at most.")
      .def(
          "mesh_path",
          [](const Robot& robot, const std::string& name) {
            return FindMesh(name, robot.texts().folder);
          },
          py::arg("name"),
          "The file of a mesh that the URDF names, sought by packages and beside the URDF;\n"
          "'' where there is none.")
      .def("contact_points", &ContactPoints, py::arg("q"),
           "The point of each contact in the world (of a sphere its centre) [n×3]; NaN for those "
           "that\n"
           "have none, as joint limits [m].");
}

}  // namespace python
}  // namespace contact_flow
