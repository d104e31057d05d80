// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/step_feedback.h"

#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kTangent = 1e-8;  // a unit tangent this far off the section is none of it

}  // namespace

ReducedMap ControlledReturn(const MechanicalSystem& system, const PoincareReturn& orbit,
                            const MatrixRef& neutral, const std::vector<int>& inputs) {
  const int n = 2 * system.dof(), m = system.num_inputs();
  if (orbit.status != ReturnStatus::kReturned || orbit.map.pieces().empty() ||
      orbit.map.cols() != n + m) {
    throw std::invalid_argument("a feedback needs the return map's derivative by the inputs");
  }
  const Matrix &begin = orbit.start_basis, &end = orbit.end_basis;
  if (begin.cols() != end.cols()) {
    throw std::invalid_argument(
        "directions along the section in the contact mode are not as many at the return as at the "
        "start: the derivative is no map of one space into itself");
  }
  if (begin.cols() == 0) {
    throw std::invalid_argument(
        "the section and the contact mode leave nothing that could deviate");
  }
  const Eigen::Index free = begin.cols(), count = static_cast<Eigen::Index>(inputs.size());
  Matrix start = Matrix::Zero(n + m, free + count);
  start.topLeftCorner(n, free) = begin;
  for (Eigen::Index k = 0; k < count; ++k) start(n + inputs.at(k), free + k) = 1;
  const Matrix seen = begin.transpose() * neutral;
  for (Eigen::Index k = 0; k < neutral.cols(); ++k) {
    if ((neutral.col(k) - begin * seen.col(k)).norm() > kTangent * neutral.col(k).norm()) {
      throw std::invalid_argument("neutral direction number " + std::to_string(k) +
                                  " is no tangent of the section that the contact mode admits");
    }
  }
  ReducedMap reduced = SetAside(InBases(orbit.map, end, start), seen);
  reduced.basis = (begin * reduced.basis).eval();
  return reduced;
}

Vector StepFeedback::Deviation(const MechanicalSystem& system, const VectorRef& state) const {
  return basis.transpose() * system.Separation(state, x);
}

Vector StepFeedback::Input(const MechanicalSystem& system, const VectorRef& state) const {
  const Vector change = law(Deviation(system, state));
  Vector input = u;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    input(inputs[k]) += change(static_cast<Eigen::Index>(k));
  }
  return input;
}

FollowedOrbit Follow(const MechanicalSystem& system, const Section& section,
                     const StepFeedback& feedback, const VectorRef& state, int count,
                     const PoincareOptions& options, double lost) {
  BudgetStage stage("the returns under a feedback", static_cast<std::size_t>(count));
  FollowedOrbit followed;
  followed.x = {state};
  followed.away = {feedback.Deviation(system, state).norm()};
  for (int k = 0; k < count && followed.away.back() <= lost; ++k) {
    AskBudget();
    stage.Next();
    const Vector& x = followed.x.back();
    const Vector u = feedback.Input(system, x);
    const PoincareReturn next = PoincareMap(system, u, section, options).Return(x, false);
    followed.status = next.status;
    followed.message = next.message;
    if (!next.returned()) break;
    followed.u.push_back(u);
    followed.away.push_back(feedback.Deviation(system, next.x).norm());
    followed.x.push_back(next.x);
  }
  return followed;
}

}  // namespace contact_flow
