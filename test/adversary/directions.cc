// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/directions.h"

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"

namespace contact_flow {
namespace adversary {
namespace {

/// A gap that opens by less than this to first order may yet close in the perturbed
/// run, by its speed.
constexpr double kClear = 1e-2;

/// Keeps contacts to first order, by the shortest change of (δq, δv).
void Project(const Case& c, ConstraintSet kept, Vector* w) {
  Variables variables;
  variables.inputs = true;
  variables.parameters = {0, 1};
  *w = ProjectAdmissible(*c.system, c.x, ContactMode(kept), *w, variables);
}

}  // namespace

void Admit(const Case& c, ConstraintSet kept, Vector* w) {
  const int d = c.system->dof();
  ConstraintTerms terms;
  c.system->Constraints(c.x.head(d), c.x.tail(d), &terms);
  Project(c, kept, w);
  for (int round = 0; round < 20; ++round) {
    bool turned = false;
    for (int i = 0; i < terms.gap.size(); ++i) {
      if (kept.Contains(i) || terms.gap(i) > 1e-9) continue;
      const Eigen::RowVectorXd a = terms.jacobian.row(i);
      const double rate = a.dot(w->head(d)) + (i == 0 ? (*w)(w->size() - 1) : 0);
      if (rate > kClear || rate == 0) continue;
      w->head(d) += (std::abs(rate) + 2 * kClear - rate) / a.squaredNorm() * a.transpose();
      turned = true;
    }
    if (!turned) return;
    Project(c, kept, w);
  }
}

Vector Directions::Next(int k, ConstraintSet kept) {
  const int d = c_.system->dof();
  Vector w = Vector::Zero(Size());
  if (k == 1 && previous_.size() > 0) {
    w = -previous_;
    Admit(c_, kept, &w);
  } else {
    const bool axis = k == 3 && draw_.Chance(0.5);
    for (int i = 0; i < 2 * d; ++i) w(i) = axis ? 0 : draw_.Normal();
    if (axis) w(draw_.Below(2 * d)) = 1;
    if (k == 2 && draw_.Chance(0.5)) {
      for (int i = 2 * d; i < Size(); ++i) w(i) = draw_.Normal();
    }
    Admit(c_, kept, &w);
    // Nothing is left of it where contacts hold all coordinates.
    w = w.norm() > 1e-6 ? Vector(w.normalized()) : Vector::Zero(Size());
  }
  previous_ = w;
  return w;
}

}  // namespace adversary
}  // namespace contact_flow
