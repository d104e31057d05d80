// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cluster_reading.h"
#include "test/adversary/directions.h"
#include "test/adversary/laws.h"
#include "test/adversary/narrow.h"
#include "test/adversary/quotients.h"
#include "test/adversary/tell.h"
#include "test/adversary/trial.h"

namespace contact_flow {
namespace adversary {
namespace {

/// A derivative may be off by this part of its size (at least 1): its own tolerance is 1e-9.
constexpr double kAccurate = 2e-5;
/// One that is off by this part is wrong, if the quotients say so clearly.
constexpr double kWrong = 2e-4;
/// … and by more than this many times the error that it tells, which is above the true one in 99 of
/// 100 runs.
constexpr double kStated = 3;
/// … and unless it moves the outcome by no more than this many times the speed of hops that the
/// reference lost: what is left of them moves other bodies.
constexpr double kLost = 10;
/// States of a run and of its reference that differ by more than this are two motions.
constexpr double kSameState = 1e-6;
/// Error of a reference state, relative.
constexpr double kReference = 3e-13;
/// A reading of merged events holds beyond this many times the radius where it begins to.
constexpr double kBeyondInner = 10;
constexpr int kDirections = 4;
constexpr double kUsual = 1e-9;  // tolerances of most runs

class Court {
 public:
  explicit Court(const Case& c)
      : c_(c),
        d_(c.system->dof()),
        loose_(std::max(
            {1.0, c.options.relative_tolerance / kUsual, c.options.absolute_tolerance / kUsual})),
        directions_(c),
        trial_(c),
        quotients_(trial_),
        given_(trial_.given()) {}

  Verdict Judge() {
    StartReference();
    if (!Differentiate()) return verdict_;
    if (!base_.doubt.empty()) return Skip("reference: " + base_.doubt);
    // Directions keep what the library takes for a contact, and what is one.
    for (int i = 0; i < c_.system->num_constraints(); ++i) {
      if (B_.initial_mode.Contains(c_.units.constraint[i])) kept_.Insert(i);
    }
    quotients_.Keep(kept_);
    if (!CompareStates()) return verdict_;
    if (!Lawful(BrokenEnergyLaw(given_, run_)) ||
        !Lawful(BrokenFlowLaw(given_, run_, B_, c_.units, loose_))) {
      return verdict_;
    }
    for (int k = 0; k < kDirections; ++k) {
      if (!Compare(Direction(k))) return verdict_;
    }
    if (verdict_.directions == 0) return Skip("no direction decides");
    verdict_.kind = Verdict::Kind::kRight;
    return verdict_;
  }

 private:
  Verdict Skip(const std::string& reason) {
    verdict_.kind = Verdict::Kind::kSkipped;
    verdict_.reason = reason;
    return verdict_;
  }

  void StartReference() {
    std::string doubt;
    held_ = trial_.InitialMode(&doubt);
    kept_ = held_;
    base_ = Run(Vector::Zero(Size()));
    if (base_.doubt.empty()) base_.doubt = doubt;
  }

  ReferenceRun Run(const Vector& w) const { return trial_.Reference(w, kept_); }
  int Size() const { return directions_.Size(); }

  /// What the library makes of it; false when there is no derivative.
  bool Differentiate() {
    try {
      run_ = trial_.Simulated(std::numeric_limits<double>::infinity());
    } catch (const std::invalid_argument& error) {
      return Refuse("start", error.what());
    }
    if (!run_.status.ok()) {
      return Refuse(std::string("run: ") + OutcomeName(run_.status.outcome), run_.status.message);
    }
    BDerivativeOptions derivative;
    derivative.variables.inputs = true;
    derivative.variables.parameters = {0, 1};
    B_ = DifferentiateOutcome(given_, run_, derivative);
    if (B_.status.ok()) return true;
    return Refuse(std::string("derivative: ") + OutcomeName(B_.status.outcome), B_.status.message);
  }

  bool Refuse(const std::string& reason, const std::string& message) {
    verdict_.kind = Verdict::Kind::kRefused;
    verdict_.detail = message;
    verdict_.reason =
        reason + " (" + Opinion(reason.find("discontinuous") != std::string::npos) + ")";
    return false;
  }

  /// What the reference says of a refusal.
  std::string Opinion(bool discontinuous) {
    if (!base_.doubt.empty()) return "reference: " + base_.doubt;
    std::vector<Vector> near, nearer;
    bool smooth = true;
    double apart = 0;
    for (int k = 0; k < 6; ++k) {
      const Vector w = Direction(k);
      const ReferenceRun first = Run(1e-6 * w), second = Run(1e-7 * w);
      if (!first.doubt.empty() || !second.doubt.empty()) return "reference refuses nearby";
      apart = std::max(apart, (second.x - base_.x).cwiseAbs().maxCoeff());
      const Vector a = (first.x - base_.x) / 1e-6, b = (second.x - base_.x) / 1e-7;
      smooth = smooth && (a - b).cwiseAbs().maxCoeff() < 1e-3 * (1 + b.cwiseAbs().maxCoeff());
    }
    if (smooth) return "needless? quotients converge";
    if (apart > 3e-5) return "outcomes stay apart";
    return discontinuous ? "needless? outcomes draw together" : "quotients do not converge";
  }

  Vector Direction(int k) { return directions_.Next(k, kept_); }

  bool CompareStates() {
    const Vector x = c_.units.Back(run_.FinalState());
    const double gain = 1 + B_.arcs.size();
    const double off = (x - base_.x).cwiseAbs().maxCoeff() / (1 + base_.x.cwiseAbs().maxCoeff());
    if (off <= kSameState * gain * loose_) return true;
    const double stated = c_.units.Back(B_.trust.state_error).cwiseAbs().maxCoeff();
    if (off <= stated / (1 + base_.x.cwiseAbs().maxCoeff())) {
      Skip("a motion that multiplies errors, as its estimate says");
      return false;
    }
    // A motion that multiplies errors: a perturbation of the tolerance tells by how much.
    const ReferenceRun again = trial_.Reference(Vector::Zero(Size()), held_, Trial::kFine);
    const double own = (again.x - base_.x).cwiseAbs().maxCoeff();
    double gain_of_errors = 0;
    for (int k = 0; k < 3; ++k) {
      const ReferenceRun moved = Run(1e-9 * Direction(0));
      if (!moved.doubt.empty()) continue;
      gain_of_errors = std::max(gain_of_errors, (moved.x - base_.x).cwiseAbs().maxCoeff() / 1e-9);
    }
    if (trial_.ReferenceMerges(run_)) {
      Skip("states differ, events are closer than the reference tells apart");
      return false;
    }
    if (!again.doubt.empty() || own > 0.01 * off || gain_of_errors * 3e-9 > 0.1 * off) {
      Skip("states differ, the reference is not sure");
      return false;
    }
    if (FoundWithMaxStep(c_, trial_, again.x, (x - base_.x).cwiseAbs().maxCoeff())) {
      Skip("a gust is shorter than the steps, and found with max_step");
      return false;
    }
    verdict_.kind = Verdict::Kind::kContradicted;
    verdict_.reason = "state";
    std::ostringstream detail;
    detail << "final states differ by " << off << " (reference by itself " << own << "); of the run"
           << Events(c_, run_) << "; of the reference" << Events(c_, base_);
    verdict_.detail = detail.str();
    return false;
  }

  /// The same, unless B refuses the direction.
  bool Compare(const Vector& w) {
    if (w.isZero(0)) return true;
    if (B_.start.Leaves(trial_.Given(w)) >= 0) return true;  // it leaves the domain
    try {
      return CompareAllowed(w);
    } catch (const std::domain_error& reason) {
      return Undecided(std::string("refused: ") + reason.what());
    }
  }

  /// B(w) beside quotients; false when it is contradicted.
  bool CompareAllowed(const Vector& w) {
    if (!Lawful(BrokenHomogeneity(B_, trial_.Given(w), c_.units))) return false;
    const Vector prediction = c_.units.Back(B_(trial_.Given(w)));
    const double size = std::max(1.0, prediction.cwiseAbs().maxCoeff());
    // What the answer says of itself: its error, and where merged events have another reading.
    const double stated = c_.units.Back(B_.Error(trial_.Given(w))).cwiseAbs().maxCoeff();
    const double inner = ReadClusters(B_, trial_.Given(w)).inner_radius;
    const double noise = (base_.settled ? 1e-9 : kReference) * (1 + base_.x.cwiseAbs().maxCoeff());
    std::vector<double> errors, alphas;
    Vector before;
    std::string doubt;
    double settled = 1e300, last = 1e300, lost = 0;
    for (double alpha : {1e-5, 1e-6, 1e-7, 1e-8}) {
      if (alpha < kBeyondInner * inner) break;
      const ReferenceRun run = Run(alpha * w);
      if (!run.doubt.empty()) {
        doubt = run.doubt;
        before.resize(0);
        continue;
      }
      lost = std::max(base_.lost, run.lost);
      const double spread = run.settled ? std::max(noise, 1e-9) : noise;
      if (spread / alpha > 0.1 * kWrong * size) break;
      const Vector quotient = (run.x - base_.x) / alpha;
      const double error = (quotient - prediction).cwiseAbs().maxCoeff();
      alphas.push_back(alpha);
      errors.push_back(error);
      if (error <= kAccurate * size) break;
      if (before.size() > 0) {
        // What is left when the error of first order in α is taken away.
        const Vector limit = quotient + (quotient - before) / 9;
        if ((limit - prediction).cwiseAbs().maxCoeff() <= kAccurate * size &&
            error < 0.2 * errors[errors.size() - 2]) {
          errors.back() = 0;
          break;
        }
        // Quotients that move the more the smaller α is have not settled.
        const double moved = (quotient - before).cwiseAbs().maxCoeff();
        const bool slows = moved < 0.5 * last || moved < 1e-3 * error;
        settled = slows ? moved : 1e300;
        last = moved;
      }
      before = quotient;
    }
    if (errors.empty()) return Undecided(doubt.empty() ? "noise" : doubt);
    if (errors.back() <= kAccurate * size) {
      ++verdict_.directions;
      return true;
    }
    // Events that are apart have an order, and a derivative, which holds for less than their delay.
    const bool near = alphas.back() < 0.1 * ShortestInterval();
    const double least = *std::min_element(errors.begin(), errors.end());
    const double wrong = std::max(kWrong * size + kStated * stated, kLost * lost / alphas.back());
    const bool clear = near && errors.size() >= 2 && errors.back() > wrong &&
                       settled < 0.1 * errors.back() && least > Quotients::kSmall * errors.back();
    if (!clear || quotients_.SayOtherwise(base_, w, prediction, errors.back()) ||
        !quotients_.AreSure(base_, alphas.back() * w, alphas.back(), errors.back())) {
      std::ostringstream text;
      text << "errors";
      for (double error : errors) text << " " << error / size;
      return Undecided(doubt + " " + text.str());
    }
    if (alphas.back() > StatedRadius(w)) return Undecided("beyond the stated radius");
    if (FoundWithMaxStep(c_, trial_, w, before, errors.back())) {
      return Undecided("a gust is shorter than the steps, and found with max_step");
    }
    verdict_.kind = Verdict::Kind::kContradicted;
    const ReferenceRun perturbed = Run(alphas.back() * w);
    const bool at_once = perturbed.events.size() > 0 && !perturbed.events[0].activated.Empty() &&
                         perturbed.events[0].t < 1e3 * alphas.back();
    verdict_.reason = at_once ? "derivative, impact at the start" : "derivative";
    std::ostringstream detail;
    detail << "errors";
    for (std::size_t k = 0; k < errors.size(); ++k)
      detail << " " << errors[k] << " at " << alphas[k];
    detail << ", |B(w)| = " << size;
    if (c_.delay > 0) detail << ", delay " << c_.delay;
    detail << "; " << SecondOpinion(c_, w, prediction, alphas.back()) << "; reference, perturbed"
           << Events(c_, perturbed);
    ConstraintTerms terms;
    c_.system->Constraints(c_.x.head(d_), c_.x.tail(d_), &terms);
    if (kept_ != held_) verdict_.reason += ", start modes differ";
    detail << "; start " << run_.arcs.front().mode.Members().bits() << ", reference "
           << PlaceBits(c_, held_) << ", gaps along w " << (terms.jacobian * w.head(d_)).transpose()
           << "; transitions" << Events(c_, run_);
    verdict_.detail = detail.str();
    return false;
  }

  /// What the answer says of how far along w it holds. Where −w makes a contact graze, the root of
  /// its speed bends the outcome along w at once, too.
  double StatedRadius(const Vector& w) const {
    const ValidityEstimator radius(given_, run_, B_);
    const Vector given = trial_.Given(w);
    return std::min(radius(given).radius, radius(-given).radius);
  }

  /// Between two events of the run.
  double ShortestInterval() const {
    double interval = std::numeric_limits<double>::infinity();
    for (std::size_t k = 1; k < run_.transitions.size(); ++k) {
      interval = std::min(interval, run_.transitions[k].t - run_.transitions[k - 1].t);
    }
    return interval / c_.units.time;
  }

  bool Lawful(const std::string& broken) {
    if (broken.empty()) return true;
    verdict_.kind = Verdict::Kind::kContradicted;
    verdict_.reason = "law";
    verdict_.detail = broken;
    return false;
  }

  bool Undecided(const std::string& why) {
    ++verdict_.undecided;
    verdict_.detail += "undecided: " + why + "; ";
    return true;
  }

  const Case& c_;
  const int d_;
  const double loose_;  // the larger tolerance, beside kUsual
  Directions directions_;
  const Trial trial_;
  Quotients quotients_;
  const RescaledSystem& given_;
  ConstraintSet held_;  // at the start, by the reference
  ConstraintSet kept_;  // by directions: also what the library holds
  ReferenceRun base_;
  Trajectory run_;
  BDerivative B_;
  Verdict verdict_;
};

}  // namespace

Verdict Judge(const Case& c) {
  if (c.skipped.empty()) return Court(c).Judge();
  Verdict verdict;
  verdict.reason = "draw: " + c.skipped;
  return verdict;
}

}  // namespace adversary
}  // namespace contact_flow
