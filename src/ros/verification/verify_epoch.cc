// SPDX-License-Identifier: BSD-3-Clause
// Where one epoch ends and the next begins.
#include <cmath>
#include <cstring>
#include <set>
#include <sstream>

#include "contact_flow/flow/manifold_projection.h"
#include "src/ros/message/conversions.h"
#include "src/session/session.h"
#include "verify_session.h"

namespace contact_flow {
namespace ros_interface {
namespace {

Vector Join(const std::vector<double>& q, const std::vector<double>& v) {
  Vector x(static_cast<Eigen::Index>(q.size() + v.size()));
  std::copy(q.begin(), q.end(), x.data());
  std::copy(v.begin(), v.end(), x.data() + q.size());
  return x;
}

/// How two vectors differ, or "". Bits count: −0 is not 0.
std::string Compare(const std::string& what, const Vector& recorded, const Vector& computed) {
  const auto size = static_cast<std::size_t>(recorded.size()) * sizeof(double);
  if (recorded.size() == computed.size() &&
      (size == 0 || std::memcmp(recorded.data(), computed.data(), size) == 0)) {
    return "";
  }
  std::ostringstream text;
  text.precision(17);
  text << what << ": recorded (" << recorded.transpose() << "), computed (" << computed.transpose()
       << ")";
  return text.str();
}

bool IsReset(const std::string& cause) {
  return cause == "reset_world" || cause == "reset_simulation";
}

}  // namespace

std::string SessionVerifier::Take(const SimulatorEpoch& epoch) {
  if (!configuration_) return "no model before it";
  static const std::set<std::string> kCauses = {
      "start",       "start_recording",  "set_state",     "apply_impulse",
      "reset_world", "reset_simulation", "set_parameters"};
  std::string difference = Owed();
  owed_.clear();
  const auto note = [&](const std::string& how) {
    if (difference.empty()) difference = how;
  };
  if (!kCauses.count(epoch.cause)) note("cause '" + epoch.cause + "' is none");
  if (epoch.header.seq != 0 || !epoch.header.frame_id.empty()) note("its header is another");
  if (epoch.impulse.empty() != (epoch.cause != "apply_impulse")) {
    note("an impulse belongs to apply_impulse alone");
  }
  if (epoch.parameter_names.size() != epoch.parameter_values.size()) {
    note("names and values of parameters are not as many");
    return difference;
  }
  Configuration configuration = *configuration_;
  for (std::size_t i = 0; i < epoch.parameter_names.size(); ++i) {
    configuration.parameters[epoch.parameter_names[i]] = epoch.parameter_values[i];
  }
  const auto setup = std::make_shared<const Setup>(configuration);
  note(CompareParameters(epoch));
  note(run_ ? CompareWithBefore(epoch, setup) : CompareWithStart(epoch, *setup));
  if (run_ && !IsReset(epoch.cause)) {
    for (const OnlineFlow::Input& input : run_->flow()->inputs_to_come()) {
      if (!(input.t > epoch.t)) continue;
      SimulatorInput owed;
      owed.t = input.t;
      owed.input.assign(input.u.data(), input.u.data() + input.u.size());
      owed_.push_back(owed);
    }
  }
  run_ = std::make_unique<EpochRun>(setup, epoch.t, Join(epoch.q, epoch.v), FromMsg(epoch.input));
  shown_.reset();
  epoch_ = epoch.epoch;
  if (epoch.cause == "start" || epoch.cause == "reset_simulation") {
    events_ = 0;
    counting_ = true;
  }
  return difference;
}

/// They change by set_parameters, and go back by reset_simulation.
std::string SessionVerifier::CompareParameters(const SimulatorEpoch& epoch) const {
  if (epoch.cause == "set_parameters") return "";
  const bool initial = epoch.cause == "start" || epoch.cause == "reset_simulation";
  std::vector<std::string> names;
  std::vector<double> values;
  if (initial) {
    if (!start_) return "";
    names = start_->parameter_names;
    values = start_->parameter_values;
  } else {
    if (!run_) return "";
    for (const Parameter& parameter : run_->system().description().parameters) {
      names.push_back(parameter.name);
      values.push_back(parameter.value);
    }
  }
  if (names != epoch.parameter_names) return "its parameters have other names";
  return Compare("parameters", FromMsg(epoch.parameter_values), FromMsg(values));
}

/// The first of a recording: where it goes on from is told, unless it is the node's start.
std::string SessionVerifier::CompareWithStart(const SimulatorEpoch& epoch,
                                              const Setup& setup) const {
  if (epoch.cause == "start_recording") return "";
  if (epoch.cause != "start") return "the recording begins with an epoch by " + epoch.cause;
  if (epoch.epoch != 1 || epoch.t != 0 || std::signbit(epoch.t) || epoch.t_before != 0 ||
      !epoch.q_before.empty() || !epoch.v_before.empty()) {
    return "nothing comes before the start";
  }
  const NominalRun& nominal = setup.system->nominal();
  const std::string input = Compare("the input", FromMsg(epoch.input), nominal.u);
  if (!input.empty()) return input;
  return Compare("the nominal state", Join(epoch.q, epoch.v), nominal.x);
}

std::string SessionVerifier::CompareWithBefore(const SimulatorEpoch& epoch,
                                               std::shared_ptr<const Setup> setup) {
  if (epoch.epoch != epoch_ + 1) {
    return "epoch " + std::to_string(epoch.epoch) + " follows epoch " + std::to_string(epoch_);
  }
  if (epoch.cause == "start" || epoch.cause == "start_recording") {
    return "cause " + epoch.cause + " in the middle of a recording";
  }
  const std::string event = AdvanceQuietlyTo(epoch.t_before);
  if (!event.empty()) return event;
  const bool initial = epoch.cause == "reset_simulation";
  const Vector u = initial ? setup->system->nominal().u : run_->flow()->NextInput();
  run_->flow()->Settle();
  const Vector before = run_->flow()->State();
  std::string difference =
      Compare("the end of the epoch before", Join(epoch.q_before, epoch.v_before), before);
  if (!difference.empty()) return difference;
  const double begin = initial ? 0 : epoch.t_before;
  if (std::memcmp(&epoch.t, &begin, sizeof(begin)) != 0) return "it begins at another time";
  difference = Compare("the input", FromMsg(epoch.input), u);
  if (!difference.empty()) return difference;
  if (epoch.cause == "set_state") return "";  // told from outside
  Vector expected = before;
  ProjectContacts(run_->system(), run_->flow()->mode(), &expected);
  if (epoch.cause == "apply_impulse") Push(*run_->setup(), FromMsg(epoch.impulse), &expected);
  if (IsReset(epoch.cause)) expected = setup->system->nominal().x;
  return Compare("the beginning of the epoch", Join(epoch.q, epoch.v), expected);
}

}  // namespace ros_interface
}  // namespace contact_flow
