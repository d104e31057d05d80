// SPDX-License-Identifier: BSD-3-Clause
#include <string>
#include <utility>

#include "contact_flow/model/rigid_body/terrain_surface.h"
#include "robot_display.h"
#include "src/ros/message/geometry.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using visualization_msgs::Marker;

/// Tiles along each side of a surface.
constexpr int kTiles = 40;
/// After which their shades repeat.
constexpr int kPattern = 4;
/// How far below the surface it is drawn, so that the visual of a table or floor hides it [m].
constexpr double kSink = 2e-3;

/// Triangles in two alternating shades.
void AddTiles(const TerrainSurface& surface, double half_width, Marker* marker) {
  const double tile = 2 * half_width / kTiles;
  const auto corner = [&](int i, int j) {
    return ToPoint(surface(i * tile - half_width, j * tile - half_width));
  };
  for (int i = 0; i < kTiles; ++i) {
    for (int j = 0; j < kTiles; ++j) {
      const double shade = (i / 2 + j / 2) % 2 == 0 ? 0.62 : 0.72;
      for (const auto& step : {std::make_pair(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}) {
        marker->points.push_back(corner(i + step.first, j + step.second));
        marker->colors.push_back(Color(shade, shade, shade, 1));
      }
    }
  }
}

}  // namespace

visualization_msgs::MarkerArray RobotDisplay::Terrain() const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, system_.nominal().x.data(), &state);
  visualization_msgs::MarkerArray array;
  for (const TerrainPiece& piece :
       TerrainNear(system_.robot(), state.body.front().reference, kSink)) {
    Marker marker = Begin("terrain", static_cast<int>(array.markers.size()), ros::Time());
    if (piece.moves) {
      marker.header.frame_id = TerrainFrame(marker.id);
      marker.frame_locked = true;
    }
    marker.type = Marker::TRIANGLE_LIST;
    marker.scale.x = marker.scale.y = marker.scale.z = 1;
    marker.color = Color(0.7, 0.7, 0.7, 1);
    AddTiles(piece.surface, options_.terrain_size, &marker);
    array.markers.push_back(marker);
  }
  return array;
}

std::string RobotDisplay::TerrainFrame(int piece) const {
  return options_.prefix + "terrain_" + std::to_string(piece + 1);
}

void RobotDisplay::AddTerrainTransforms(
    const VectorRef& x, const ros::Time& stamp,
    std::vector<geometry_msgs::TransformStamped>* transforms) const {
  const RobotDescription& robot = system_.robot();
  if (robot.model.clock < 0) return;
  const double t = x(robot.model.ClockCoordinate().q);
  const double period = kPattern * 2 * options_.terrain_size / kTiles;
  int id = 0;
  for (const TerrainPiece& piece : TerrainNear(robot, Vec3<double>::Zero())) {
    const std::string frame = TerrainFrame(id++);
    if (!piece.moves) continue;
    const Vec3<double> shown = TerrainDisplacement(robot, piece.constraint, t, period);
    transforms->push_back(
        ToTransform(Mat3<double>::Identity(), shown, options_.world_frame, frame, stamp));
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
