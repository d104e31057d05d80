// SPDX-License-Identifier: BSD-3-Clause
// Contacts from meshes: the vertices that are kept, against all of them; files that are missing.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/io/mesh_file.h"
#include "test/io/contact_robots.h"
#include "test/refusal.h"

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

/// As rospack does: a package is called what its package.xml says, whatever its folder is.
TEST_F(ContactsOfMeshes, AreFoundInAPackageWhoseFolderHasAnotherName) {
  const std::string clone = folder_ + "clone/", urdf = clone + "urdf/";
  for (const std::string& made : {clone, urdf}) ::mkdir(made.c_str(), 0700);
  std::ofstream(clone + "egg.stl") << "solid egg\nendsolid egg\n";
  std::ofstream(clone + "package.xml") << "<package>\n  <name> arms </name>\n</package>\n";
  EXPECT_EQ(clone + "egg.stl", FindMesh("package://arms/egg.stl", urdf));
  EXPECT_EQ("", FindMesh("package://legs/egg.stl", urdf));
  EXPECT_EQ("", FindMesh("package://arms/egg.stl", ""));
  const char* path = std::getenv("ROS_PACKAGE_PATH");
  const std::string before = path != nullptr ? path : "";
  ::setenv("ROS_PACKAGE_PATH", ("/nowhere:" + clone).c_str(), 1);
  EXPECT_EQ(clone + "egg.stl", FindMesh("package://arms/egg.stl", ""));
  if (path != nullptr) {
    ::setenv("ROS_PACKAGE_PATH", before.c_str(), 1);
  } else {
    ::unsetenv("ROS_PACKAGE_PATH");
  }
}

/// In the two texts, however the YAML is written: in lines, in braces, with a mark of its end.
TEST_F(ContactsOfMeshes, AreKeptInTheYaml) {
  const std::string rest = "contacts: {ground: all, vertices: 4}";
  const std::string urdf =
      "<robot name=\"r\">" + UnitLink("a", Mesh("file://" + folder_ + "egg.stl")) + "</robot>";
  for (const std::string& yaml : {"base: floating\n" + rest, "{base: floating, " + rest + "}",
                                  "base: floating\n" + rest + "\n...\n"}) {
    const std::string path = folder_ + "egg.yaml";
    std::ofstream(path) << yaml;
    RobotTexts texts = ReadRobotTexts(path, urdf);
    RobotTexts told{urdf, yaml, "", ""};
    KeepMeshContacts(&told);
    EXPECT_EQ(texts.yaml, told.yaml);
    const std::size_t at = texts.urdf.find("egg.stl");
    texts.urdf.replace(at, 7, "gone.stl");
    EXPECT_EQ(4, MakeRobot(texts)->num_constraints()) << yaml;
    std::remove(path.c_str());
  }
}

/// 80 bytes that say anything, "solid", too; a count; and a normal, three corners and two bytes of
/// each triangle.
TEST_F(ContactsOfMeshes, MayBeBinary) {
  const auto append = [](float number, std::string* bytes) {
    char four[4];
    std::memcpy(four, &number, 4);
    bytes->append(four, 4);
  };
  for (const std::string header : {"made by a program", "solid egg"}) {
    std::string bytes = header + std::string(80 - header.size(), ' ');
    bytes += std::string("\x2c\x01\0\0", 4);  // 300
    for (std::size_t k = 0; k < points_.size(); ++k) {
      if (k % 3 == 0) bytes += std::string(12, '\0');
      for (double entry : points_[k]) append(static_cast<float>(entry), &bytes);
      if (k % 3 == 2) bytes += std::string(2, '\0');
    }
    const std::string path = folder_ + "binary.stl";
    std::ofstream(path, std::ios::binary) << bytes;
    const std::vector<Vec3<double>> read = ReadMeshVertices(path);
    ASSERT_EQ(points_.size(), read.size()) << header;
    for (std::size_t k = 0; k < read.size(); ++k) {
      EXPECT_LT((read[k] - points_[k]).norm(), 1e-7) << k;
    }
    std::ofstream(path, std::ios::binary) << bytes.substr(0, bytes.size() - 1);
    const std::string cut = test::RefusalOf([&] { ReadMeshVertices(path); });
    EXPECT_NE(std::string::npos, cut.find("there are no vertices")) << cut;
    std::remove(path.c_str());
  }
}

/// COLLADA with a node that is turned a quarter about z and moved, in a file whose "up" is y, which
/// is passed over; where there is no assimp the message says so.
TEST_F(ContactsOfMeshes, MayBeOfOtherFormats) {
  const std::string path = folder_ + "plate.dae";
  std::ofstream(path) << R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 0.5 0 0 0 0.25 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>1 2 3</translate>
<node><rotate>0 0 1 90</rotate><instance_geometry url="#g"/></node></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";
  std::vector<Vec3<double>> read;
  const std::string refusal = test::RefusalOf([&] { read = ReadMeshVertices(path); });
  if (refusal.find("no assimp") != std::string::npos) GTEST_SKIP() << "built without assimp";
  ASSERT_EQ("", refusal);
  ASSERT_EQ(3u, read.size());
  const Vec3<double> expected[] = {{1, 2, 3}, {1, 2.5, 3}, {0.75, 2, 3}};
  for (const Vec3<double>& corner : expected) {
    const bool there = std::any_of(read.begin(), read.end(), [&](const Vec3<double>& vertex) {
      return (vertex - corner).norm() < 1e-6;
    });
    EXPECT_TRUE(there) << corner.transpose();
  }
  std::ofstream(path) << "no mesh";
  const std::string damaged = test::RefusalOf([&] { ReadMeshVertices(path); });
  EXPECT_NE(std::string::npos, damaged.find("plate.dae")) << damaged;
  std::remove(path.c_str());
}

}  // namespace
}  // namespace contact_flow
