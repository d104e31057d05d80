// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/return_section.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

int IndexOf(const std::string& kind, const std::string& name,
            const std::vector<std::string>& valid) {
  const auto found = std::find(valid.begin(), valid.end(), name);
  if (found == valid.end()) throw std::invalid_argument(UnknownName(kind, name, valid));
  return static_cast<int>(found - valid.begin());
}

}  // namespace

Section Section::Coordinate(const MechanicalSystem& system, const std::string& name, double value,
                            int sign) {
  return {Kind::kCoordinate, IndexOf("coordinate", name, system.description().coordinates), value,
          sign};
}

Section Section::Apex(const MechanicalSystem& system, const std::string& coordinate) {
  return {Kind::kVelocity, IndexOf("velocity", coordinate, system.description().velocities), 0, -1};
}

Section Section::Event(const MechanicalSystem& system, const std::string& constraint) {
  return {Kind::kEvent, IndexOf("constraint", constraint, system.description().constraints), 0, -1};
}

Section Section::After(double seconds) { return {Kind::kTime, 0, seconds, 0}; }

void Validate(const MechanicalSystem& system, const Section& section) {
  const int sizes[] = {system.num_positions(), system.dof(), system.num_constraints(), 1};
  if (section.index < 0 || section.index >= sizes[static_cast<int>(section.kind)]) {
    throw std::invalid_argument("section: there is no number " + std::to_string(section.index) +
                                " of its kind");
  }
  if (section.kind == Section::Kind::kTime && !(section.value > 0)) {
    throw std::invalid_argument("section: " + std::to_string(section.value) + " s is no period");
  }
}

double Section::Height(const MechanicalSystem& system, const VectorRef& x, Vector* gradient) const {
  const int d = system.dof(), nq = system.num_positions(), i = index;
  *gradient = Vector::Zero(2 * d);
  switch (kind) {
    case Section::Kind::kCoordinate: {
      Vector rate(nq);
      const Vector q = x.head(nq);
      for (int k = 0; k < d; ++k) {
        const Vector unit = Vector::Unit(d, k);
        system.space().Rate(q.data(), unit.data(), rate.data());
        (*gradient)(k) = rate(i);
      }
      return x(i) - value;
    }
    case Section::Kind::kVelocity:
      (*gradient)(d + i) = 1;
      return x(nq + i) - value;
    case Section::Kind::kEvent: {
      ConstraintTerms terms;
      system.Constraints(x.head(nq), x.tail(d), &terms);
      gradient->head(d) = terms.jacobian.row(i).transpose();
      return terms.gap(i);
    }
    case Section::Kind::kTime:
      break;
  }
  return 0;
}

}  // namespace contact_flow
