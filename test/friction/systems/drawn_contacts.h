// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <random>

#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/random_contacts.h"

namespace contact_flow {
namespace test {

/// Draws numbers.
class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double Normal() { return normal_(random_); }
  double Uniform(double low, double high) { return low + (high - low) * uniform_(random_); }
  bool Chance(double part) { return uniform_(random_) < part; }
  Matrix Normals(int rows, int columns, double size) {
    Matrix A(rows, columns);
    for (double& entry : A.reshaped()) entry = size * Normal();
    return A;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0, 1};
};

/// A random system with friction, and a start of it.
struct DrawnContacts {
  std::unique_ptr<RandomContacts> system;
  Vector x;
  double size = 1;  ///< of its lengths [m]
  double duration = 0.6;
};

/// One to four contacts with `rows` tangents each. Some start on contacts, some land on two at
/// once, a fifth have lengths of 1e-4 or 1e4 m.
DrawnContacts DrawContacts(unsigned seed, int rows);

/// Tolerances of 1e-12, for lengths of `size` m.
SimulateOptions TightOptions(double size);

}  // namespace test
}  // namespace contact_flow
