// SPDX-License-Identifier: BSD-3-Clause
// Contacts from meshes: the vertices that are kept, against all of them; files that are missing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "contact_flow/io/mesh_file.h"
#include "test/io/contact_robots.h"

namespace contact_flow {
namespace {

using test::Collision;
using test::GeometryRefusal;
using test::LowestGap;
using test::Parse;
using test::Placed;
using test::UnitLink;
using test::Warns;

class ContactsOfMeshes : public testing::Test {
 protected:
  /// A text STL of points on an ellipsoid, all sorts of which are inside others' hull.
  void SetUp() override {
    folder_ = testing::TempDir() + "contacts_test_";
    std::ofstream file(folder_ + "egg.stl");
    file << "solid egg\n";
    std::mt19937 generator(4);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 900; ++k) {
      Vec3<double> p(normal(generator), normal(generator), normal(generator));
      p.normalize();
      p = p.cwiseProduct(Vec3<double>(0.1, 0.2, 0.3));
      points_.push_back(p);
      if (k % 3 == 0) file << "facet normal 0 0 1\nouter loop\n";
      file << "vertex " << p(0) << " " << p(1) << " " << p(2) << "\n";
      if (k % 3 == 2) file << "endloop\nendfacet\n";
    }
    file << "endsolid egg\n";
  }
  void TearDown() override { std::remove((folder_ + "egg.stl").c_str()); }
  std::string Mesh(const std::string& name) const {
    return Collision("<mesh filename=\"" + name + "\"/>");
  }

  std::string folder_;
  std::vector<Vec3<double>> points_;
};

TEST_F(ContactsOfMeshes, AreThinnedByAStatedError) {
  const RobotDescription robot =
      Parse(UnitLink("a", Mesh("file://" + folder_ + "egg.stl")),
            "{base: floating, contacts: {ground: all, vertices: 16, tolerance: 0}}");
  double stated = 0;
  for (const std::string& warning : robot.model.warnings) {
    const std::size_t at = warning.find("by up to ");
    if (at != std::string::npos) stated = std::stod(warning.substr(at + 9));
  }
  EXPECT_GT(stated, 0);
  EXPECT_LT(stated, 0.05);
  const RobotSystem system(
      Parse(UnitLink("a", Mesh("file://" + folder_ + "egg.stl")),
            "{base: floating, contacts: {ground: all, vertices: 16, tolerance: 0}}"),
      {});
  EXPECT_EQ(16, system.num_constraints());
  std::mt19937 generator(5);
  double largest = 0;
  for (int k = 0; k < 300; ++k) {
    const Placed placed(&generator);
    double lowest = HUGE_VAL;
    for (const Vec3<double>& point : points_) {
      lowest = std::min(lowest, (placed.centre + placed.rotation * point)(2));
    }
    const double error = LowestGap(system, placed.q) - lowest;
    EXPECT_GE(error, -1e-6);  // the file holds six digits
    largest = std::max(largest, error);
  }
  // Between two of the 2562 directions, 0.07 rad apart, a point 0.3 m off reaches 0.1 % further.
  EXPECT_LE(largest, 1.01 * stated + 1e-3);
}

TEST_F(ContactsOfMeshes, ThatAreMissingAreAWarningUnlessAskedFor) {
  const std::string robot =
      UnitLink("a", Mesh("package://nowhere/a.stl") + Collision("<sphere radius=\"0.1\"/>"));
  const RobotDescription read = Parse(robot, "{base: floating, contacts: {ground: all}}");
  EXPECT_EQ(1u, read.constraints.size());
  EXPECT_TRUE(Warns(read,
                    "link 'a' (line 1 of the URDF): its mesh 'package://nowhere/a.stl' is "
                    "not found"));
  const std::string refusal = GeometryRefusal(robot, "{base: floating, contacts: {ground: [a]}}");
  EXPECT_NE(std::string::npos, refusal.find("link 'a'")) << refusal;
  EXPECT_NE(std::string::npos, refusal.find("ROS_PACKAGE_PATH")) << refusal;
}

TEST_F(ContactsOfMeshes, AreFoundInThePackagesAroundTheUrdf) {
  const std::string folder = testing::TempDir();
  const std::string package = folder.substr(folder.rfind('/', folder.size() - 2) + 1);
  EXPECT_EQ(folder_ + "egg.stl",
            FindMesh("package://" + package + "contacts_test_egg.stl", folder));
  EXPECT_EQ(folder_ + "egg.stl", FindMesh("contacts_test_egg.stl", folder));
  EXPECT_EQ("", FindMesh("package://" + package + "no.stl", folder));
  EXPECT_EQ(900u, ReadMeshVertices(folder_ + "egg.stl").size());
}

}  // namespace
}  // namespace contact_flow
