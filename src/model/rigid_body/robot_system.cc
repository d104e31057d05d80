// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/robot_system.h"

#include <Eigen/QR>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "robot_scratch.h"

namespace contact_flow {
namespace {

/// A nominal state below a surface, or beyond a stop, is no start; others may be. Depths of
/// rounding, as below gap_tolerance, are none.
void WarnOfPenetration(const RobotSystem& system, RobotDescription* robot) {
  constexpr double kTouches = 1e-9;
  ConstraintTerms terms;
  const Vector& x = system.nominal().x;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  int deepest = -1, count = 0;
  for (int i = 0; i < system.num_constraints(); ++i) {
    if (system.compliant().Contains(i) || !(terms.gap(i) < -kTouches)) continue;
    ++count;
    if (deepest < 0 || terms.gap(i) < terms.gap(deepest)) deepest = i;
  }
  if (count == 0) return;
  const ElementParts& parts = robot->constraints[deepest]->parts;
  std::ostringstream warning;
  warning << "the nominal state penetrates constraint '" << parts.name << "': its gap is "
          << terms.gap(deepest);
  if (count > 1) warning << ", the lowest of " << count << " below 0";
  warning << parts.where << "; runs are refused to begin there: give `nominal` other positions, "
          << "the constraint another place, or begin elsewhere";
  robot->model.warnings.push_back(warning.str());
}

}  // namespace

RobotSystem::RobotSystem(RobotDescription robot, const ParameterValues& values)
    : robot_(std::move(robot)) {
  Describe();
  CheckParameterNames(description_.name, values, description_.parameters);
  CheckPlaces(robot_.parameters);
  for (std::size_t i = 0; i < robot_.parameters.size(); ++i) {
    ExposedNumber& number = robot_.parameters[i];
    const auto it = values.find(number.parameter.name);
    if (it != values.end()) number.parameter.value = it->second;
    CheckParameter(description_.name, number.parameter.name, number.parameter.value, number.range);
    for (const NumberPlace& place : number.places) {
      SetNumber(place, number.parameter.value, &robot_);
    }
    description_.parameters[i] = number.parameter;
  }
  robot_.model.tree.set_gravity({0, 0, -robot_.gravity});
  robot_.model.JoinInertias();
  robot_.model.CheckMass();
  constant_mass_ = robot_.model.tree.HasConstantMass();
  affine_constraints_ = true;
  for (const auto* list : {&robot_.constraints, &robot_.closures}) {
    for (const auto& element : *list) {
      all_constraints_.push_back(element.get());
      constraint_geometry_.emplace_back(robot_.model.tree, element->parts);
      affine_constraints_ &= element->IsAffine() && constraint_geometry_.back().IsAffine() &&
                             (element->slip.rows == 0 || element->IsSlipAffine());
    }
  }
  for (const auto& element : robot_.efforts) {
    effort_geometry_.emplace_back(robot_.model.tree, element->parts);
    forces_on_points_ |= !element->parts.points.empty();
    const int index = static_cast<int>(effort_geometry_.size()) - 1;
    if (element->HasLimit()) {
      limited_.push_back({index, false});
      limited_names_.push_back(element->parts.name);
    }
    if (element->HasSpeedLimit()) {
      limited_.push_back({index, true});
      limited_names_.push_back(element->parts.name + "/speed");
    }
  }
  for (int i : robot_.switches) compliant_.Insert(i);
  contact_effort_ = !robot_.switches.empty();
  restitution_.resize(num_constraints());
  for (int i = 0; i < num_constraints(); ++i) {
    restitution_(i) = robot_.constraints[i]->restitution.value;
  }
  DescribeFriction();
  DescribeKnots();
  nominal_ = robot_.nominal;
  CheckElements();
  WarnOfPenetration(*this, &robot_);
}

RobotSystem::~RobotSystem() = default;
RobotSystem::Shelf::~Shelf() { delete scratch.load(); }

void RobotSystem::CheckElements() const {
  const RobotModel& model = robot_.model;
  const int count = static_cast<int>(all_constraints_.size());
  const int clock = model.clock >= 0 ? model.ClockCoordinate().v : -1;
  for (int i = 0; i < count; ++i) {
    const std::vector<int>& columns = constraint_geometry_[i].columns();
    const bool of_time = columns.size() == 1 && columns[0] == clock && constraint(i).Touches();
    if (!columns.empty() && !of_time) continue;
    throw std::invalid_argument("constraint '" + constraint(i).parts.name +
                                "' is between parts that do not move");
  }
  for (std::size_t i = 0; i < robot_.efforts.size(); ++i) {
    if (!effort_geometry_[i].columns().empty()) continue;
    throw std::invalid_argument("effort '" + robot_.efforts[i]->parts.name +
                                "' is between parts that do not move");
  }
  const Vector q = nominal_.x.head(num_positions()), v = nominal_.x.tail(dof());
  ConstraintTerms terms, around;
  Constraints(q, v, &terms);
  const Vector moved = Perturb(nominal_.x, Vector::LinSpaced(2 * dof(), 0.01, 0.02));
  Constraints(moved.head(num_positions()), v, &around);
  const auto pushed = [&](const ConstraintTerms& at, int i) {  // all but the clock
    Vector row = at.jacobian.row(i);
    if (clock >= 0 && constraint(i).Touches()) row(clock) = 0;
    return row;
  };
  for (int i = 0; i < count; ++i) {
    bool finite = std::isfinite(terms.gap(i)) && std::isfinite(terms.bias(i)) &&
                  terms.jacobian.row(i).allFinite();
    const int row = slip_row(i), rows = constraint(i).slip.rows;
    for (int r = row; rows > 0 && r < row + rows; ++r) {
      finite = finite && std::isfinite(terms.bias(r)) && terms.jacobian.row(r).allFinite();
    }
    // An arm that hangs straight above the floor moves its tip along it, but only there.
    const bool still = pushed(terms, i).isZero(0);
    if (finite && (!still || (terms.gap(i) > 0 && !pushed(around, i).isZero(0)))) continue;
    const bool closes = i >= num_constraints();
    throw std::invalid_argument(
        (closes ? "closure '" : "constraint '") + constraint(i).parts.name +
        "' is degenerate in the nominal state" + constraint(i).parts.where + ": " +
        (closes ? "nothing moves it there; leave it out, or its letter of `axes`"
                : "its function has no gradient there; give its direction or point another value, "
                  "or `nominal` other positions"));
  }
  CheckClosures(terms, around);
  Vector force;
  Dynamics(q, v, nominal_.u, ContactMode(), nullptr, &force);
  for (int j = 0; j < dof(); ++j) {
    if (std::isfinite(force(j))) continue;
    throw std::invalid_argument("the efforts on '" + description_.velocities[j] +
                                "' are not finite in the nominal state");
  }
}

void RobotSystem::CheckClosures(const ConstraintTerms& nominal,
                                const ConstraintTerms& around) const {
  constexpr double kRank = 1e-9;
  const auto independent = [&](const ConstraintTerms& terms, int count) {
    const Matrix rows = terms.jacobian.middleRows(num_constraints(), count).rowwise().normalized();
    Eigen::ColPivHouseholderQR<Matrix> qr(rows.transpose());
    qr.setThreshold(kRank);
    return qr.rank() == count;
  };
  for (int count = 1; count <= num_bilateral(); ++count) {
    if (independent(nominal, count) || independent(around, count)) continue;
    const ElementParts& parts = constraint(num_constraints() + count - 1).parts;
    throw std::invalid_argument("closure '" + parts.name + "' is redundant" + parts.where +
                                ": the closures before it hold what it holds; leave it out, or its "
                                "letter of `axes`");
  }
}

void RobotSystem::Describe() {
  const RobotModel& model = robot_.model;
  description_.name = model.name;
  description_.summary = "robot of " + std::to_string(model.links.size()) + " links and " +
                         std::to_string(model.tree.dof()) + " degrees of freedom";
  description_.coordinates = model.coordinates;
  description_.units = model.units;
  description_.velocities = model.velocities;
  description_.inputs = robot_.inputs;
  for (const auto& element : robot_.constraints) {
    description_.constraints.push_back(element->parts.name);
  }
  for (const auto& element : robot_.closures) {
    description_.bilateral.push_back(element->parts.name);
  }
  for (const ExposedNumber& number : robot_.parameters) {
    description_.parameters.push_back(number.parameter);
  }
  using Factor = ConfigurationSpace::Factor;
  const std::vector<RigidBodyTree::Body>& bodies = model.tree.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    switch (bodies[i].joint) {
      case JointKind::kRevolute:
        space_.Append(model.circle[i] ? Factor::kCircle : Factor::kLine);
        break;
      case JointKind::kBall:
        space_.Append(Factor::kRotation);
        break;
      default:
        space_.Append(Factor::kLine, bodies[i].num_dofs);
    }
  }
}

void RobotSystem::AddEfforts(const VectorRef& q, const VectorRef& v, const ContactMode& mode,
                             Scratch* s) const {
  for (std::size_t i = 0; i < robot_.efforts.size(); ++i) {
    const EffortElement& element = *robot_.efforts[i];
    const ElementGeometry& geometry = effort_geometry_[i];
    geometry.Place(s->state, q.data(), &s->motion);
    geometry.Move(s->state, v.data(), &s->motion);
    TakeInputs(static_cast<int>(i), mode, s);
    element.Evaluate(s->motion.z, s->motion.rate, s->u, s->e);
    geometry.Push(s->state, s->motion, s->e, s->external.data(), s->effort.data());
  }
  if (robot_.weight_share.size() == 0) return;
  Weigh(q, s);
  s->effort += robot_.weight_share.cwiseProduct(s->weight);
}

void RobotSystem::Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                           const ContactMode& mode, Matrix* mass, Vector* force) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  const RigidBodyTree& tree = robot_.model.tree;
  s->MoveTo(tree, q.data(), v.data());
  s->TakeInertias(tree);
  s->ClearForces();
  CloseLoop(q, v, u, s);
  AddEfforts(q, v, mode, s);
  InverseDynamics<double>(tree, tree.gravity(), nullptr,
                          forces_on_points_ ? s->external.data() : nullptr, &s->state,
                          s->tau.data());
  *force = s->effort - s->tau;
  if (mass == nullptr) return;
  mass->resize(tree.dof(), tree.dof());
  MassMatrix(tree, &s->state, mass->data());
  if (robot_.armature.size() > 0) mass->diagonal() += robot_.armature;
}

void RobotSystem::Constraints(const VectorRef& q, const VectorRef& v,
                              ConstraintTerms* terms) const {
  terms->gap.setZero(num_rows());
  terms->jacobian.setZero(num_rows(), dof());
  FillConstraints(nullptr, q, v, terms);
}

void RobotSystem::ConstraintsOf(const ConstraintSet& asked, const VectorRef& q, const VectorRef& v,
                                ConstraintTerms* terms) const {
  terms->gap.resize(num_rows());
  terms->jacobian.resize(num_rows(), dof());
  VisitConstraints(&asked, [&](int i) {
    terms->jacobian.row(i).setZero();
    if (slip_row(i) < 0) return;
    const int rows = constraint(i).slip.rows;
    terms->gap.segment(slip_row(i), rows).setZero();
    terms->jacobian.middleRows(slip_row(i), rows).setZero();
  });
  FillConstraints(&asked, q, v, terms);
}

/// Gradients are added to rows that are zero.
void RobotSystem::FillConstraints(const ConstraintSet* asked, const VectorRef& q,
                                  const VectorRef& v, ConstraintTerms* terms) const {
  terms->bias.resize(num_rows());
  if (all_constraints_.empty()) return;
  const Loan loan(this);
  Scratch* s = loan.get();
  const RigidBodyTree& tree = robot_.model.tree;
  const Vec3<double> weightless = Vec3<double>::Zero();
  s->MoveTo(tree, q.data(), v.data());
  UpdateAccelerations<double>(tree, weightless, nullptr, &s->state);
  VisitConstraints(asked, [&](int i) {
    const ElementGeometry& geometry = constraint_geometry_[i];
    geometry.Place(s->state, q.data(), &s->motion);
    geometry.Move(s->state, v.data(), &s->motion);
    geometry.Accelerate(s->state, weightless, nullptr, &s->motion);
    geometry.Columns(s->state, s->motion, &s->rows);
    double* gradient = s->e;
    terms->gap(i) = constraint(i).Gap(s->motion.z, gradient);
    terms->bias(i) = constraint(i).Curvature(s->motion.z, s->motion.rate);
    for (int k = 0; k < constraint(i).size(); ++k) {
      terms->bias(i) += gradient[k] * s->motion.acceleration[k];
      for (std::size_t c = 0; c < geometry.columns().size(); ++c) {
        terms->jacobian(i, geometry.columns()[c]) += gradient[k] * s->rows.z_q(k, c);
      }
    }
    if (slip_row(i) >= 0) AddSlipTerms(i, s, terms);
  });
}

}  // namespace contact_flow
