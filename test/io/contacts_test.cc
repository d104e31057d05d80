// SPDX-License-Identifier: BSD-3-Clause
// Contacts from collision geometry, against the support functions of the shapes themselves.
#include "contact_flow/io/contacts.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "contact_flow/io/mesh_file.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

const char kInertial[] =
    "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" "
    "iyz=\"0\"/></inertial>";
const char kOrigin[] = "<origin xyz=\"0.1 -0.2 0.3\" rpy=\"0.4 0.5 0.6\"/>";

std::string Collision(const std::string& geometry, const std::string& origin = kOrigin) {
  return "<collision>" + origin + "<geometry>" + geometry + "</geometry></collision>";
}
std::string Link(const std::string& name, const std::string& content) {
  return "<link name=\"" + name + "\">" + kInertial + content + "</link>";
}
std::string Robot(const std::string& content) {
  return "<robot name=\"r\">" + content + "</robot>";
}

RobotDescription Parse(const std::string& content, const std::string& yaml,
                       const std::string& folder = "") {
  return ParseRobot(Robot(content), YAML::Load(yaml), folder);
}
std::string Refusal(const std::string& content, const std::string& yaml) {
  try {
    Parse(content, yaml);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}
bool Warns(const RobotDescription& robot, const std::string& words) {
  for (const std::string& warning : robot.model.warnings) {
    if (warning.find(words) != std::string::npos) return true;
  }
  return false;
}

/// The pose of `kOrigin` in a link at a random place, as (rotation, position) in the world.
struct Placed {
  Vector q = Vector::Zero(7);
  Mat3<double> rotation;
  Vec3<double> centre;

  explicit Placed(std::mt19937* generator) {
    std::normal_distribution<double> normal;
    for (int k = 0; k < 7; ++k) q(k) = normal(*generator);
    q.tail<4>().normalize();
    const Eigen::Quaterniond body(q(3), q(4), q(5), q(6));
    const Mat3<double> origin = (Eigen::AngleAxisd(0.6, Vec3<double>::UnitZ()) *
                                 Eigen::AngleAxisd(0.5, Vec3<double>::UnitY()) *
                                 Eigen::AngleAxisd(0.4, Vec3<double>::UnitX()))
                                    .toRotationMatrix();
    rotation = body.toRotationMatrix() * origin;
    centre = q.head<3>() + body.toRotationMatrix() * Vec3<double>(0.1, -0.2, 0.3);
  }
};

double LowestGap(const RobotSystem& system, const Vector& q) {
  ConstraintTerms terms;
  system.Constraints(q, Vector::Zero(system.dof()), &terms);
  return terms.gap.minCoeff();
}

TEST(Contacts, OfSmoothShapesAreExact) {
  std::mt19937 generator(1);
  // Lowest point of each shape below its centre, by its support function along −z.
  using Depth = double (*)(const Mat3<double>&);
  const struct {
    const char* geometry;
    int count;
    Depth depth;
  } shapes[] = {
      {"<sphere radius=\"0.3\"/>", 1, [](const Mat3<double>&) { return 0.3; }},
      {"<box size=\"0.2 0.4 0.6\"/>", 8,
       [](const Mat3<double>& R) {
         return 0.1 * std::abs(R(2, 0)) + 0.2 * std::abs(R(2, 1)) + 0.3 * std::abs(R(2, 2));
       }},
      {"<capsule radius=\"0.1\" length=\"0.5\"/>", 2,
       [](const Mat3<double>& R) { return 0.25 * std::abs(R(2, 2)) + 0.1; }},
  };
  for (const auto& shape : shapes) {
    const RobotSystem system(
        Parse(Link("a", Collision(shape.geometry)),
              "{base: floating, contacts: {ground: all, height: 0.25, restitution: 0.5}}"),
        {});
    EXPECT_EQ(shape.count, system.num_constraints());
    EXPECT_EQ(0.5, system.restitution()(0));
    for (int k = 0; k < 100; ++k) {
      const Placed placed(&generator);
      // Positions of a few metres are exact to 1e-15.
      EXPECT_NEAR(placed.centre(2) - shape.depth(placed.rotation) - 0.25,
                  LowestGap(system, placed.q), 2e-9)
          << shape.geometry;
    }
  }
}

/// A wheel: its lowest point is half the width along the axis, and the radius across it.
TEST(Contacts, OfAWheelAreItsRims) {
  const RobotSystem system(
      Parse(Link("a", "") +
                Link("wheel", Collision("<cylinder radius=\"0.3\" length=\"0.1\"/>",
                                        "<origin xyz=\"0 0 0\" rpy=\"1.5707963267948966 0 0\"/>")) +
                "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"wheel\"/>"
                "<axis xyz=\"0 1 0\"/></joint>",
            "{base: floating, contacts: {ground: [wheel]}}"),
      {});
  ASSERT_EQ(2, system.num_constraints());
  std::mt19937 generator(2);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 100; ++k) {
    Vector q(8);
    for (int i = 0; i < 8; ++i) q(i) = normal(generator);
    q.segment<4>(3).normalize();
    const Eigen::Quaterniond body(q(3), q(4), q(5), q(6));
    const double along = (body * Vec3<double>(0, 1, 0))(2);
    EXPECT_NEAR(q(2) - 0.05 * std::abs(along) - 0.3 * std::sqrt(1 - along * along),
                LowestGap(system, q), 1e-8);  // YAML holds 1e-9
  }
}

/// Cylinders that are no wheels lie inside the true shape, by at most what is said.
TEST(Contacts, OfOtherCylindersLieInside) {
  std::mt19937 generator(3);
  for (const double length : {0.1, 1.0}) {
    const double radius = 0.2;
    const RobotSystem system(Parse(Link("a", Collision("<cylinder radius=\"0.2\" length=\"" +
                                                       std::to_string(length) + "\"/>")),
                                   "{base: floating, contacts: {ground: all}}"),
                             {});
    const double error =
        length > 2 * radius ? (std::sqrt(2.) - 1) * radius : (1 - std::cos(M_PI / 6)) * radius;
    for (int k = 0; k < 200; ++k) {
      const Placed placed(&generator);
      const double along = placed.rotation(2, 2);
      const double exact =
          placed.centre(2) - 0.5 * length * std::abs(along) - radius * std::sqrt(1 - along * along);
      const double gap = LowestGap(system, placed.q);
      EXPECT_GE(gap, exact - 1e-8);
      EXPECT_LE(gap, exact + error + 1e-8);
    }
  }
}

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
      Parse(Link("a", Mesh("file://" + folder_ + "egg.stl")),
            "{base: floating, contacts: {ground: all, vertices: 16, tolerance: 0}}");
  double stated = 0;
  for (const std::string& warning : robot.model.warnings) {
    const std::size_t at = warning.find("by up to ");
    if (at != std::string::npos) stated = std::stod(warning.substr(at + 9));
  }
  EXPECT_GT(stated, 0);
  EXPECT_LT(stated, 0.05);
  const RobotSystem system(
      Parse(Link("a", Mesh("file://" + folder_ + "egg.stl")),
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
      Link("a", Mesh("package://nowhere/a.stl") + Collision("<sphere radius=\"0.1\"/>"));
  const RobotDescription read = Parse(robot, "{base: floating, contacts: {ground: all}}");
  EXPECT_EQ(1u, read.constraints.size());
  EXPECT_TRUE(Warns(read,
                    "link 'a' (line 1 of the URDF): its mesh 'package://nowhere/a.stl' is "
                    "not found"));
  const std::string refusal = Refusal(robot, "{base: floating, contacts: {ground: [a]}}");
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

const char kLegs[] = R"(
<joint name="h" type="continuous"><parent link="body"/><child link="thigh"/></joint>
<joint name="k" type="continuous"><parent link="thigh"/><child link="foot"/>
  <origin xyz="0 0 -0.5"/></joint>
<joint name="a" type="continuous"><parent link="body"/><child link="arm"/></joint>)";

std::string Walker() {
  const auto ball = [](double z) {
    return Collision("<sphere radius=\"0.05\"/>",
                     "<origin xyz=\"0 0 " + std::to_string(z) + "\"/>");
  };
  return Link("body", ball(0)) + Link("thigh", ball(-0.2)) + Link("foot", ball(-0.4)) +
         Link("arm", ball(0.3)) + kLegs;
}

TEST(Contacts, FeetAreTheLowestEnds) {
  const RobotDescription feet = Parse(Walker(), "{base: floating, contacts: {ground: feet}}");
  ASSERT_EQ(1u, feet.constraints.size());
  EXPECT_EQ("foot", feet.constraints[0]->parts.name);
  EXPECT_EQ(4u, Parse(Walker(), "{base: floating, contacts: {ground: all}}").constraints.size());
  EXPECT_EQ(
      2u, Parse(Walker(), "{base: floating, contacts: {ground: [arm, foot]}}").constraints.size());
  EXPECT_EQ(0u, Parse(Walker(), "{base: floating, contacts: {ground: none}}").constraints.size());
}

TEST(Contacts, AreMadeWhereNothingIsSaid) {
  const RobotDescription robot = Parse(Walker(), "base: floating");
  EXPECT_EQ(4u, robot.constraints.size());
  EXPECT_TRUE(Warns(robot, "neither `constraints` nor `contacts` is given: 4 contacts"));
  // The foot is 0.5 + 0.4 + 0.05 below the base: 0.1 m above the ground.
  EXPECT_NEAR(1.05, robot.nominal.x(2), 1e-9);
  EXPECT_EQ(2, Parse(Walker(), "{base: floating, nominal: {positions: {base_z: 2}}}").nominal.x(2));
  // One that hangs in the world, or has contacts of its own, gets none.
  EXPECT_EQ(0u, Parse(Walker(), "base: fixed").constraints.size());
  EXPECT_EQ(1u, Parse(Walker(), "{base: floating, constraints: {c: {kind: plane, link: foot}}}")
                    .constraints.size());
  EXPECT_TRUE(Warns(Parse(Link("a", ""), "base: floating"), "NO CONTACTS"));
}

TEST(Contacts, AreAddedToThoseOfTheFile) {
  EXPECT_EQ(2u, Parse(Walker(),
                      "{base: floating, contacts: {ground: feet}, "
                      "constraints: {c: {kind: plane, link: arm}}}")
                    .constraints.size());
  EXPECT_NE("", Refusal(Walker(),
                        "{base: floating, contacts: {ground: feet}, "
                        "constraints: {foot: {kind: plane, link: arm}}}"));
}

TEST(Contacts, AreFewerWhereThereAreTooMany) {
  std::string boxes = Link("l0", Collision("<box size=\"1 1 1\"/>", ""));
  for (int k = 1; k < 9; ++k) {
    const std::string name = "l" + std::to_string(k);
    boxes += Link(name, Collision("<box size=\"1 1 1\"/>", "")) + "<joint name=\"j" +
             std::to_string(k) + "\" type=\"continuous\"><parent link=\"l0\"/><child link=\"" +
             name + "\"/><origin xyz=\"0 0 " + std::to_string(k) + "\"/></joint>";
  }
  const RobotDescription robot = Parse(boxes, "base: floating");
  EXPECT_TRUE(Warns(robot, "of the feet (of all links there were too many)"));
  EXPECT_EQ(4u, robot.constraints.size());  // the lower face of the lowest end
  const std::string refusal = Refusal(boxes, "{base: floating, contacts: {ground: all}}");
  EXPECT_NE(std::string::npos, refusal.find("72 contacts, at most 64 are possible (line 1)"))
      << refusal;
}

TEST(Contacts, RefuseWithLineValueAndRemedy) {
  const struct {
    const char* yaml;
    const char* words;
  } cases[] = {
      {"{ground: foo}", "contacts/ground: unknown link 'foo'; did you mean 'foot'? (line 1)"},
      {"{ground: [foot, legs]}", "unknown link 'legs'"},
      {"{grund: feet}", "contacts: 'ground' is missing (line 1)"},
      {"{ground: feet, restitution: 2}", "contacts/restitution is 2, expected 0 to 1 (line 1)"},
      {"{ground: feet, vertices: 0}", "contacts/vertices"},
      {"{ground: feet, vertices: 100}", "contacts/vertices"},
      {"{ground: feet, tolerance: -1}", "contacts/tolerance is negative (line 1)"},
      {"{ground: feet, heigth: 1}", "did you mean"},
      {"feet", "contacts is 'feet', expected a map"},
  };
  for (const auto& bad : cases) {
    const std::string refusal =
        Refusal(Walker(), "{base: floating, contacts: " + std::string(bad.yaml) + "}");
    EXPECT_NE(std::string::npos, refusal.find(bad.words)) << refusal << " of " << bad.yaml;
  }
}

}  // namespace
}  // namespace contact_flow
