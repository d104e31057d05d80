// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/grid_derivative.h"

#include <stdexcept>
#include <string>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "input_cluster.h"

namespace contact_flow {

GridDerivative::GridDerivative(const MechanicalSystem& system, const Trajectory& trajectory,
                               const BDerivativeOptions& options)
    : intervals_(Linearize(system, trajectory, options)) {
  status_ = trajectory.status;
  for (const IntervalLinearization& interval : intervals_) {
    if (status_.ok()) status_ = interval.derivative.status;
  }
  if (!status_.ok()) return;
  const InputClusters clusters(system, trajectory);
  for (std::size_t k = 0; k < trajectory.transitions.size(); ++k) {
    if (!trajectory.transitions[k].changes_input) continue;
    jumps_.emplace_back();
    if (clusters.At(k) != nullptr) continue;
    const Arc &before = trajectory.arcs[k], &after = trajectory.arcs[k + 1];
    const Vector field = ContactDynamics(system, before.u).Field(before.x_end, before.mode);
    jumps_.back() = field - ContactDynamics(system, after.u).Field(after.x_begin, after.mode);
  }
}

Vector GridDerivative::Follow(const VectorRef& dx, const MatrixRef& du, const VectorRef& dt,
                              std::vector<ContactMode>* modes) const {
  if (!status_.ok()) throw std::domain_error("there is no derivative: " + status_.message);
  const auto count = static_cast<Eigen::Index>(intervals_.size());
  const BDerivative& first = intervals_.front().derivative;
  const Eigen::Index size = first.time.size(), inputs = first.arcs.front().cols() - size;
  const bool fits = dx.size() == size && du.rows() == inputs && du.cols() == count &&
                    (dt.size() == 0 || dt.size() == count - 1);
  if (!fits) {
    throw std::invalid_argument("a direction of " + std::to_string(dx.size()) +
                                " entries, inputs of " + std::to_string(du.rows()) + " × " +
                                std::to_string(du.cols()) + " and " + std::to_string(dt.size()) +
                                " instants: " + std::to_string(size) + ", " +
                                std::to_string(inputs) + " × " + std::to_string(count) + " and " +
                                std::to_string(count - 1) + " or none are needed");
  }
  Vector w(size + inputs);
  w << dx, du.col(0);
  if (modes != nullptr) modes->push_back(first.initial_mode);
  for (Eigen::Index k = 0; k < count; ++k) {
    const BDerivative& interval = intervals_[static_cast<std::size_t>(k)].derivative;
    w.tail(inputs) = du.col(k);
    if (k == 0) {
      w = interval.Begin(w);
    } else if (!interval.start_stop.Empty()) {
      w = interval.start_stop.matrix() * w;  // what sticks does so already, to rounding
    }
    w = interval.Along(0, w);
    for (std::size_t j = 0; j < interval.events.size(); ++j) {
      const EventMap& event = interval.events[j];
      const Eigen::Index changes = event.absorbed() ? 0 : event.num_input_changes();
      Vector shift = Vector::Zero(changes);
      if (changes > 0 && dt.size() > 0) shift = dt.segment(k, changes);
      if (modes != nullptr) {
        const std::vector<ContactMode> passed = event.PerturbedModes(w);
        modes->insert(modes->end(), passed.begin(), passed.end());
      }
      w = interval.Along(j + 1, event(w, shift));
    }
    if (k + 1 < count && dt.size() > 0) {
      const Vector& jump = jumps_[static_cast<std::size_t>(k)];
      if (jump.size() > 0) w.head(size) += jump.head(size) * dt(k);
    }
  }
  return w.head(size);
}

Vector GridDerivative::operator()(const VectorRef& dx, const MatrixRef& du,
                                  const VectorRef& dt) const {
  return Follow(dx, du, dt, nullptr);
}

std::vector<ContactMode> GridDerivative::PerturbedModes(const VectorRef& dx,
                                                        const MatrixRef& du) const {
  std::vector<ContactMode> modes;
  Follow(dx, du, Vector(), &modes);
  return modes;
}

}  // namespace contact_flow
