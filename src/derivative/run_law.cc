// SPDX-License-Identifier: BSD-3-Clause
#include "run_law.h"

#include <algorithm>
#include <sstream>

#include "contact_flow/derivative/trust.h"

namespace contact_flow {
namespace {

/// Residuals below this need not be carried, and those above it fail at the end: relative to
/// the largest field at the events and at T.
constexpr double kNoLaw = 1e-12, kRunLimit = 2e-5;

}  // namespace

Status CheckRunLaw(const Trajectory& trajectory, std::size_t first,
                   const std::vector<EventResidual>& residuals, const ArcProduct& carry,
                   BDerivative* derivative) {
  const Eigen::Index d2 = derivative->time.size();
  double size = derivative->time.lpNorm<Eigen::Infinity>();  // a run may end at rest
  for (const EventResidual& residual : residuals) size = std::max(size, residual.size);
  if (!(size > 0)) return {};
  Matrix carried = Matrix::Zero(residuals.empty() ? d2 : residuals.front().value.size(), 1);
  double largest = 0;
  std::size_t worst = 0;
  bool any = false;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const double own = residuals[k].value.lpNorm<Eigen::Infinity>();
    any = any || own > kNoLaw * size;
    if (!any) continue;
    if (!carried.isZero(0)) carried = derivative->events[k].AnySelection() * carried;
    carried += residuals[k].value;
    carry(k + 1, &carried);
    if (own > largest) worst = k;
    largest = std::max(largest, own);
  }
  const double residual = carried.col(0).head(d2).lpNorm<Eigen::Infinity>() / size;
  derivative->trust.event_law = std::max(derivative->trust.event_law, residual);
  if (!(residual > kRunLimit)) return {};
  std::ostringstream message;
  message << "the self-check B(F(x0)) = F(x(T)) fails by " << residual << " (limit " << kRunLimit
          << "), most by what the transition at t = " << trajectory.transitions[first + worst].t
          << " s neglects: the derivative is withheld";
  return {Outcome::kNotDifferentiable, message.str()};
}

}  // namespace contact_flow
