// SPDX-License-Identifier: BSD-3-Clause
#include "session.h"

#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/manifold_projection.h"
#include "number_checks.h"
#include "run_request.h"

namespace contact_flow {
namespace {

constexpr double kFarAhead = 3600;  // [s] for which inputs may be told

}  // namespace

Session::Session(const Configuration& configuration, std::vector<std::string> tangent_directions,
                 Log log, StepClock clock)
    : tangent_directions_(std::move(tangent_directions)),
      log_(std::move(log)),
      clock_(std::move(clock)),
      initial_setup_(std::make_shared<const Setup>(configuration)) {
  const NominalRun& nominal = initial_setup_->system->nominal();
  Begin("start", 0, initial_setup_, nominal.x, nominal.u, Vector());
}

/// The new epoch is there, or nothing has happened.
void Session::Begin(const std::string& cause, double t, std::shared_ptr<const Setup> setup,
                    const Vector& x, const Vector& u, const Vector& impulse) {
  auto run = std::make_unique<EpochRun>(setup, t, x, u);
  const Eigen::Index nq = setup->system->num_positions(), d = setup->system->dof();
  EpochBegin begin;
  begin.epoch = epoch_ + 1;
  begin.cause = cause;
  begin.t = t;
  begin.q = x.head(nq);
  begin.v = x.tail(d);
  begin.u = u;
  begin.parameters = setup->system->description().parameters;
  begin.impulse = impulse;
  if (run_) {
    run_->flow()->Settle();
    const Vector before = run_->flow()->State();
    begin.t_before = now();
    begin.q_before = before.head(nq);
    begin.v_before = before.tail(d);
  }
  ++epoch_;
  parameters_changed_ = parameters_changed_ || !run_ || run_->setup() != setup;
  run_ = std::move(run);
  run_->LimitMark(limits_.mark_seconds, clock_);
  ended_ = Status();
  begun_ = now();
  spent_ = 0;
  patience_ = 1;
  if (log_.epoch) log_.epoch(begin);
}

void Session::LimitSteps(const StepLimits& limits) {
  limits_ = limits;
  run_->LimitMark(limits.mark_seconds, clock_);
}

void Session::End(Outcome outcome, const std::string& reason) {
  if (!status().ok()) return;
  std::ostringstream message;
  message.precision(12);
  message << reason << " (stopped at t = " << now() << " s)";
  ended_ = {outcome, message.str()};
  if (!run_->marked()) return;
  AskedMark none;
  none.clear = true;
  Mark(none);
}

/// The mark was given up: whoever repeats this has to know.
void Session::TellLostMark() {
  const std::string loss = run_->TakeLoss();
  if (loss.empty()) return;
  if (log_.warning) log_.warning(loss);
  AskedMark none;
  none.clear = true;
  Mark(none);
}

bool Session::TakeParametersChanged() { return std::exchange(parameters_changed_, false); }

bool Session::AdvanceTo(double t) {
  if (!status().ok()) return false;
  const double before = now(), begin = clock_.processor();
  bool event = false, done = true;
  try {
    const BudgetScope slice(clock_.OfWall(patience_ * limits_.slice_seconds));
    event = run_->AdvanceTo(t);
  } catch (const BudgetExceeded&) {
    done = false;
  } catch (const std::exception& error) {
    End(Outcome::kNonFinite, error.what());
    return false;
  }
  if (event) ++events_;
  spent_ += clock_.processor() - begin;
  // What did not even take one step has to be begun anew, with more time.
  patience_ = done || now() > before ? 1 : 2 * patience_;
  if (event) return true;  // it is told before anything else of this instant
  TellLostMark();
  if (spent_ > limits_.step_seconds) {
    std::ostringstream reason;
    reason << StepLimits::kInstant
           << " s of the motion take more than step_seconds = " << limits_.step_seconds
           << " s of processor time: it is too quick to go along with";
    End(Outcome::kBudgetExceeded, reason.str());
  } else if (now() >= begun_ + StepLimits::kInstant) {
    begun_ = now();
    spent_ = 0;
  }
  return false;
}

void Session::ResetSimulation() {
  const NominalRun& nominal = initial_setup_->system->nominal();
  events_ = 0;
  Begin("reset_simulation", 0, initial_setup_, nominal.x, nominal.u, Vector());
}

void Session::ResetWorld() {
  const Vector u = run_->flow()->NextInput();  // which ends with the flow
  Begin("reset_world", now(), setup(), run_->system().nominal().x, u, Vector());
}

void Session::Restart(const std::string& cause, std::shared_ptr<const Setup> setup,
                      const std::function<void(Vector*)>& change, const Vector& impulse) {
  const MechanicalSystem& system = *setup->system;
  const Vector u = run_->flow()->NextInput();
  // First on what the state is between steps: if that is refused, no step is cut.
  Vector x = run_->flow()->State();
  ProjectContacts(run_->system(), run_->flow()->mode(), &x);
  change(&x);
  InitialMode(system, x, u, setup->options);
  const std::vector<OnlineFlow::Input> inputs(run_->flow()->inputs_to_come().begin(),
                                              run_->flow()->inputs_to_come().end());
  x = run_->SettledState();
  change(&x);
  try {
    Begin(cause, now(), std::move(setup), x, u, impulse);
  } catch (const std::invalid_argument&) {
    TellInput(now(), u);  // it has been cut all the same
    throw;
  }
  for (const OnlineFlow::Input& input : inputs) {  // what was told for later holds all the same
    if (input.t > now()) TellInput(input.t, input.u);
  }
}

void Session::BeginEpoch(const std::string& cause) {
  Restart(
      cause, setup(), [](Vector*) {}, Vector());
}

void Session::SetState(const AskedState& state) {
  Restart(
      "set_state", setup(), [&](Vector* x) { ApplyState(run_->system(), state, x); }, Vector());
}

void Push(const Setup& setup, const Vector& impulse, Vector* x) {
  x->tail(setup.system->dof()) = PushedVelocity(
      *setup.system, *x, impulse, setup.options.gap_tolerance, setup.options.impact_law);
}

void Session::ApplyImpulse(const std::vector<std::string>& names,
                           const std::vector<double>& impulse) {
  const MechanicalSystem& system = run_->system();
  Vector p = Vector::Zero(system.dof());
  const std::vector<std::string>& velocities = system.description().velocities;
  const std::vector<std::string>& asked = names.empty() ? velocities : names;
  CheckSize("impulse", impulse.size(), asked.size(), asked);
  ApplyNamed("velocity", names, impulse, velocities, &p);
  Restart(
      "apply_impulse", setup(), [&](Vector* x) { Push(*setup(), p, x); }, p);
}

void Session::SetParameters(const std::vector<std::string>& names,
                            const std::vector<double>& values) {
  const std::vector<Parameter>& parameters = run_->system().description().parameters;
  std::vector<std::string> valid;
  Vector numbers(static_cast<Eigen::Index>(parameters.size()));
  for (const Parameter& parameter : parameters) {
    numbers(static_cast<Eigen::Index>(valid.size())) = parameter.value;
    valid.push_back(parameter.name);
  }
  if (names.empty()) throw std::invalid_argument("names is empty, expected at least one parameter");
  ApplyNamed("parameter", names, values, valid, &numbers);
  Configuration configuration = setup()->configuration;
  for (std::size_t i = 0; i < valid.size(); ++i) {
    configuration.parameters[valid[i]] = numbers(static_cast<Eigen::Index>(i));
  }
  Restart(
      "set_parameters", std::make_shared<const Setup>(configuration), [](Vector*) {}, Vector());
}

void Session::SetInput(double t, const std::vector<std::string>& names,
                       const std::vector<double>& values) {
  if (!(t <= now() + kFarAhead)) {
    std::ostringstream text;
    text << "the input begins at " << t << " s, expected at most " << kFarAhead
         << " s after the present " << now() << " s";
    throw std::invalid_argument(text.str());
  }
  if (run_->flow()->inputs_to_come().size() >= kMaxIntervals) {
    throw std::invalid_argument(std::to_string(kMaxIntervals) +
                                " inputs are waiting for their time: no more are accepted");
  }
  Vector u = run_->flow()->NextInput();
  for (const OnlineFlow::Input& input : run_->flow()->inputs_to_come()) {
    if (input.t <= t) u = input.u;
  }
  ApplyNamed("input", names, values, run_->system().description().inputs, &u);
  TellInput(t, u);
}

void Session::TellInput(double t, const Vector& u) {
  run_->flow()->SetInput(t, u);
  if (log_.input) log_.input({epoch_, t, u});
}

Directions Session::Mark(AskedMark asked) {
  asked.epoch = epoch_;
  asked.t = now();
  if (!asked.clear && asked.directions.names.empty() && asked.directions.matrix.data.empty()) {
    asked.directions.names = tangent_directions_;
  }
  run_->Mark(asked);
  if (log_.mark) log_.mark(asked);
  return run_->marked() ? run_->directions() : Directions();
}

std::optional<MarkReading> Session::ReadMark() {
  std::optional<MarkReading> reading = run_->ReadMark();
  TellLostMark();
  return reading;
}

Snapshot Session::AskPrediction(AskedPrediction* asked) {
  Snapshot present = run_->Present(*asked);
  asked->epoch = epoch_;
  asked->index = ++predictions_;
  asked->t = now();
  if (log_.asked) log_.asked(*asked);
  return present;
}

void Session::TellPrediction(const Prediction& prediction) {
  if (log_.predicted) log_.predicted(prediction);
}

}  // namespace contact_flow
