// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/draws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/model/model_library.h"
#include "test/ensemble/requests.h"

namespace contact_flow {
namespace {

using Kind = DrawPart::Kind;

DrawPart Normal(std::vector<std::string> names, Vector mean, Matrix covariance) {
  DrawPart part;
  part.kind = Kind::kNormal;
  part.names = std::move(names);
  part.mean = std::move(mean);
  part.covariance = std::move(covariance);
  return part;
}

DrawPart Grid(std::vector<std::string> names, std::vector<Vector> levels) {
  DrawPart part;
  part.kind = Kind::kGrid;
  part.names = std::move(names);
  part.levels = std::move(levels);
  return part;
}

Vector DrawOne(const Draws& draws, std::uint64_t run) {
  Vector values;
  Sampler(draws).Draw(run, &values);
  return values;
}

std::string Refusal(const Draws& draws) {
  try {
    Sampler sampler(draws);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Draws, GridsGoThroughAllCombinations) {
  Draws draws;
  draws.parts = {Grid({"a", "b"}, {Eigen::Vector2d(1, 2), Eigen::Vector3d(10, 20, 30)}),
                 Grid({"c"}, {Eigen::Vector2d(5, 6)})};
  const Sampler sampler(draws);
  EXPECT_EQ(12u, sampler.period());
  EXPECT_FALSE(sampler.IsRandom());
  EXPECT_EQ((std::vector<std::string>{"a", "b", "c"}), sampler.names());
  std::uint64_t run = 0;
  for (int again = 0; again < 2; ++again) {
    for (double a : {1, 2}) {
      for (double b : {10, 20, 30}) {
        for (double c : {5, 6}) EXPECT_EQ(Vector(Eigen::Vector3d(a, b, c)), DrawOne(draws, run++));
      }
    }
  }
}

TEST(Draws, TablesGoRowByRow) {
  Draws draws;
  draws.parts.resize(1);
  draws.parts[0].kind = Kind::kTable;
  draws.parts[0].names = {"a", "b"};
  draws.parts[0].table = (Matrix(3, 2) << 1, 2, 3, 4, 5, 6).finished();
  EXPECT_EQ(Vector(Eigen::Vector2d(3, 4)), DrawOne(draws, 1));
  EXPECT_EQ(Vector(Eigen::Vector2d(1, 2)), DrawOne(draws, 3));
}

TEST(Draws, UniformIsPhilox) {
  Draws draws;
  draws.seed = 11;
  draws.parts = {Uniform({"a", "b"}, Eigen::Vector2d(-1, 2), Eigen::Vector2d(1, 2.5))};
  Philox random(11, 77);
  const double a = -1 + 2 * random.Uniform(), b = 2 + 0.5 * random.Uniform();
  EXPECT_EQ(Vector(Eigen::Vector2d(a, b)), DrawOne(draws, 77));
}

TEST(Draws, NormalsHaveTheirCovariance) {
  // n = 10⁵: entries within 5 √((P_ii P_jj + P_ij²)/n). The second matrix has rank 1.
  const Matrix first = (Matrix(2, 2) << 4, 1, 1, 2).finished();
  const Matrix second = (Matrix(2, 2) << 4, 2, 2, 1).finished();
  for (const Matrix& P : {first, second}) {
    for (bool sobol : {false, true}) {
      Draws draws;
      draws.sobol = sobol;
      draws.parts = {Normal({"a", "b"}, Eigen::Vector2d(1, -1), P)};
      const Sampler sampler(draws);
      const int n = 100000;
      Matrix moment = Matrix::Zero(2, 2);
      Vector sum = Vector::Zero(2), z;
      for (int run = 0; run < n; ++run) {
        sampler.Draw(static_cast<std::uint64_t>(run), &z);
        z -= draws.parts[0].mean;
        sum += z / n;
        moment += z * z.transpose() / n;
      }
      for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(0, sum(i), 5 * std::sqrt(P(i, i) / n));
        for (int j = 0; j < 2; ++j) {
          EXPECT_NEAR(P(i, j), moment(i, j),
                      5 * std::sqrt((P(i, i) * P(j, j) + P(i, j) * P(i, j)) / n));
        }
      }
    }
  }
}

TEST(Draws, PartsShareTheStreamInOrder) {
  Draws draws;
  draws.seed = 3;
  draws.parts = {Uniform({"a"}, Vector::Zero(1), Vector::Ones(1)),
                 Grid({"g"}, {Eigen::Vector2d(1, 2)}),
                 Normal({"b"}, Vector::Zero(1), Matrix::Identity(1, 1))};
  Philox random(3, 1);
  const double a = random.Uniform(), b = random.Normal();
  EXPECT_EQ(Vector(Eigen::Vector3d(a, 2, b)), DrawOne(draws, 1));
}

TEST(Draws, WhatIsWrongIsSaid) {
  const auto one = [](const DrawPart& part) {
    Draws draws;
    draws.parts = {part};
    return Refusal(draws);
  };
  EXPECT_NE(std::string::npos,
            one(Uniform({"a"}, Vector::Ones(1), Vector::Zero(1))).find("low is above high"));
  EXPECT_NE("", one(Uniform({"a", "b"}, Vector::Zero(1), Vector::Ones(1))));
  EXPECT_NE("", one(Uniform({"a"}, Vector::Constant(1, NAN), Vector::Ones(1))));
  EXPECT_NE("", one(Grid({"a"}, {Vector()})));
  EXPECT_NE(std::string::npos,
            one(Normal({"a", "b"}, Vector::Zero(2), (Matrix(2, 2) << 1, 2, 2, 1).finished()))
                .find("semidefinite"));
  EXPECT_NE(std::string::npos,
            one(Normal({"a", "b"}, Vector::Zero(2), (Matrix(2, 2) << 0, 1, 1, 1).finished()))
                .find("semidefinite"));
  EXPECT_NE(std::string::npos,
            one(Normal({"a", "b"}, Vector::Zero(2), (Matrix(2, 2) << 1, 0, 1, 1).finished()))
                .find("symmetric"));
  EXPECT_NE(std::string::npos,
            one(Uniform({"a", "+a"}, Vector::Zero(2), Vector::Ones(2))).find("twice"));
}

TEST(StartMap, PutsNumbersWhereTheirNamesAre) {
  const auto system = MakeModel("soft_biped", {});
  const Vector x = system->nominal().x, u = system->nominal().u;
  const StartMap map(*system, {"body_pitch", "+body_z", "d/dt body_pitch", "stiffness",
                               "+gravity"}, x, u);
  EXPECT_TRUE(map.ChangesParameters());
  Vector values(5);
  values << 0.1, 0.2, 0.3, 30, 0.5;
  RunStart start;
  map.Apply(values, &start);
  const auto names = EnsembleStateNames(system->description());
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double wanted = names[k] == "body_pitch"        ? 0.1
                          : names[k] == "body_z"          ? x(i) + 0.2
                          : names[k] == "d/dt body_pitch" ? 0.3
                                                          : x(i);
    EXPECT_EQ(wanted, start.x(i)) << names[k];
  }
  EXPECT_EQ(30, start.parameters.at("stiffness"));
  EXPECT_EQ(1 + 0.5, start.parameters.at("gravity"));
}

TEST(StartMap, TurnsWhatHasNoCoordinate) {
  const auto system = MakeModel("falling_box", {});
  const SystemDescription& d = system->description();
  const Vector x = system->nominal().x;
  std::string turned;
  for (const std::string& velocity : d.velocities) {
    if (std::find(d.coordinates.begin(), d.coordinates.end(), velocity) == d.coordinates.end()) {
      turned = velocity;
    }
  }
  ASSERT_NE("", turned);
  const auto tangents = EnsembleTangentNames(d);
  Vector w = Vector::Zero(2 * system->dof());
  w(std::find(tangents.begin(), tangents.end(), turned) - tangents.begin()) = 0.3;
  RunStart start;
  StartMap(*system, {"+" + turned}, x, system->nominal().u).Apply(Vector::Constant(1, 0.3), &start);
  EXPECT_EQ(system->Perturb(x, w), start.x);
  EXPECT_THROW(StartMap(*system, {turned}, x, system->nominal().u), std::invalid_argument);
  std::string number;   // of the quaternion
  for (std::size_t k = 0; k < d.coordinates.size(); ++k) {
    if (system->space().line_velocities()[k] < 0) number = d.coordinates[k];
  }
  EXPECT_THROW(StartMap(*system, {number}, x, system->nominal().u), std::invalid_argument);
}

TEST(StartMap, UnknownNamesHaveANearestOne) {
  const auto system = MakeModel("soft_biped", {});
  try {
    StartMap(*system, {"body_pich"}, system->nominal().x, system->nominal().u);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("'body_pitch'")) << error.what();
  }
}

}  // namespace
}  // namespace contact_flow
