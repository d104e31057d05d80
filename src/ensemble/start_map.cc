// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <stdexcept>

#include "contact_flow/ensemble/draws.h"
#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

using Names = std::vector<std::string>;

/// Index of the name, −1 where it is none of them.
int Find(const Names& names, const std::string& name) {
  const auto it = std::find(names.begin(), names.end(), name);
  return it == names.end() ? -1 : static_cast<int>(it - names.begin());
}

Names WithRates(Names names, const Names& velocities) {
  for (const std::string& velocity : velocities) names.push_back("d/dt " + velocity);
  return names;
}

/// Indices in q of the numbers of quaternions.
bool IsOfQuaternion(const MechanicalSystem& system, int index) {
  return index < system.num_positions() &&
         system.space().line_velocities()[static_cast<std::size_t>(index)] < 0;
}

}  // namespace

Names EnsembleStateNames(const SystemDescription& d) {
  return WithRates(d.coordinates, d.velocities);
}

Names EnsembleTangentNames(const SystemDescription& d) {
  return WithRates(d.velocities, d.velocities);
}

StartMap::StartMap(const MechanicalSystem& system, const Names& names, const VectorRef& x,
                   const VectorRef& u)
    : system_(system), x_(x), u_(u) {
  const SystemDescription& d = system.description();
  if (x.size() != system.state_size() || u.size() != system.num_inputs()) {
    throw std::invalid_argument("the start has " + std::to_string(x.size()) + " states and " +
                                std::to_string(u.size()) + " inputs, expected " +
                                std::to_string(system.state_size()) + " and " +
                                std::to_string(system.num_inputs()));
  }
  const Names states = EnsembleStateNames(d), tangents = EnsembleTangentNames(d);
  Names parameters;
  for (const Parameter& p : d.parameters) parameters.push_back(p.name);
  for (const std::string& name : names) {
    const bool added = name.rfind('+', 0) == 0;
    const std::string plain = added ? name.substr(1) : name;
    const int tangent = Find(tangents, plain), state = Find(states, plain);
    const int input = Find(d.inputs, plain), parameter = Find(parameters, plain);
    if ((tangent >= 0 || state >= 0) + (input >= 0) + (parameter >= 0) > 1) {
      throw std::invalid_argument(QuoteName(plain) + " names two things of " + d.name);
    }
    Place place{Place::Kind::kInput, input, added};
    if (added && tangent >= 0) {
      place = {Place::Kind::kTangent, tangent, true};
      has_tangent_ = true;
    } else if (!added && state >= 0 && !IsOfQuaternion(system, state)) {
      place = {Place::Kind::kState, state, false};
    } else if (parameter >= 0) {
      place = {Place::Kind::kParameter, parameter, added};
      changes_parameters_ = true;
    } else if (state >= 0) {
      throw std::invalid_argument(QuoteName(name) +
                                  " is of a quaternion, whose numbers are not "
                                  "free; draw '+' and an angular velocity's name");
    } else if (tangent >= 0) {
      throw std::invalid_argument(QuoteName(name) + " has no coordinate of its own; '+" + plain +
                                  "' turns the start by so much");
    } else if (input < 0) {
      Names valid = states;
      valid.insert(valid.end(), tangents.begin(), tangents.end());
      valid.insert(valid.end(), d.inputs.begin(), d.inputs.end());
      valid.insert(valid.end(), parameters.begin(), parameters.end());
      throw std::invalid_argument(UnknownName("name", plain, valid));
    }
    if (place.kind == Place::Kind::kInput && !added) replaces_inputs_ = true;
    places_.push_back(place);
  }
}

void StartMap::Apply(const VectorRef& values, RunStart* start) const {
  start->x = x_;
  start->u = u_;
  start->parameters.clear();
  Vector w;
  if (has_tangent_) w = Vector::Zero(2 * system_.dof());
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Place& place = places_[k];
    const double value = values(static_cast<Eigen::Index>(k));
    if (place.kind == Place::Kind::kState) {
      start->x(place.index) = value;
    } else if (place.kind == Place::Kind::kTangent) {
      w(place.index) = value;
    } else if (place.kind == Place::Kind::kInput) {
      start->u(place.index) = place.added ? u_(place.index) + value : value;
    } else {
      const Parameter& p = system_.description().parameters[static_cast<std::size_t>(place.index)];
      start->parameters[p.name] = place.added ? p.value + value : value;
    }
  }
  if (has_tangent_) start->x = system_.Perturb(start->x, w);
}

}  // namespace contact_flow
