// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/word_selection.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "contact_flow/dynamics/guards.h"
#include "coordinate_reach.h"
#include "dependent_rows.h"
#include "frame_words.h"
#include "friction_group.h"
#include "known_pads.h"
#include "row_units.h"
#include "slips_in_space.h"
#include "turning_onset.h"
#include "word_ahead.h"
#include "word_trend.h"

namespace contact_flow {
namespace {

/// A look ahead moves the state by this part of its size; a slip that begins in space is so fast
/// there, for its direction [m/s].
constexpr double kAhead = 1e-6, kBegun = 1e-9;
/// Inequalities with more than this slack, relative, hold for a while.
constexpr double kStrict = 1e-7;
/// What shrinks by so many roundings is no rounding of forces that are larger than their sum.
constexpr double kNoticed = 1e3;

class Words {
 public:
  Words(ContactDynamics* dynamics, const VectorRef& x, const TouchingContacts& touching)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        x_(x),
        touching_(touching),
        nq_(system_.num_positions()),
        d_(system_.dof()),
        frame_(system_, Inertia(), touching.still | touching.slipping) {
    const Matrix& A = frame_.rows();
    const InverseInertia inertia = Inertia();
    FrictionProblem& problem = frame_.problem();
    const Vector free = inertia.FreeAcceleration();
    problem.b = A * free + frame_.bias();
    units_.emplace(problem);
    scale_ = units_->Largest(problem.b);
    rounding_ = AccelerationRounding(problem, *units_, free.dot(inertia.mass() * free));
    problem.slack = rounding_;
    for (std::size_t k = 0; k < frame_.constraints().size(); ++k) {
      const int i = frame_.constraints()[k];
      before_.push_back(touching.before.LetterOf(i));
      if (touching.slack.size() > 0) problem.slack(static_cast<int>(k)) += touching.slack(i);
    }
    SetSlips(touching, x.tail(d_), &frame_);
  }

  ContactMode Find(double border, WordConventions* by) {
    std::vector<FrictionSolution> all = SolveFrictionFrom(frame_.problem(), border, before_);
    const auto ended = std::remove_if(all.begin(), all.end(), [this](const FrictionSolution& word) {
      return touching_.ended && word.letters == before_;
    });
    if (ended != all.begin()) all.erase(ended, all.end());
    const ContactMode found = FindAmong(all, border, by);
    for (const FrictionSolution& word : all) {
      if (!word.turns || ModeOf(word) != found) continue;
      if (by == nullptr) {
        Refuse(FrictionRefusal::Kind::kSlipFromRestInSpace,
               "some begin to slip in several directions, as their body turns");
      }
      by->turns = true;
    }
    return found;
  }

 private:
  ContactMode FindAmong(const std::vector<FrictionSolution>& all, double border,
                        WordConventions* by) {
    if (all.empty()) {
      Refuse(FrictionRefusal::Kind::kInconsistent, Dependent() && !AllSlip(frame_)
                                                       ? "no word was found whose forces fit"
                                                       : "no contact forces exist");
    }
    for (const FrictionSolution& word : all) {
      if (!word.many && !(word.springs && by == nullptr)) continue;
      Refuse(FrictionRefusal::Kind::kIndeterminateForces,
             "in the word '" + ModeOf(word).Word(system_.num_constraints()) +
                 "' the motion depends on how forces are shared");
    }
    if (all.size() == 1) {
      const ContactMode only = ModeOf(all.front());
      if (by != nullptr) by->springs = all.front().springs;
      if (Ends(all.front(), border)) return Beyond(all.front(), border, by);
      const bool ends =
          by != nullptr && (Ends(all.front(), border, true) || SpringsLetGo(&dynamics_, x_, only));
      if (!ends) return only;
      const auto ahead = FindWordAhead(&dynamics_, x_, touching_, only, border, true);
      if (!ahead) return only;
      by->springs = true;
      return ahead->mode;
    }
    if (Dependent()) {
      if (const std::optional<ContactMode> ahead = Ahead(all, border)) return *ahead;
    }
    ConstraintSet varying;
    for (std::size_t k = 0; k < frame_.constraints().size(); ++k) {
      for (const FrictionSolution& word : all) {
        if (word.letters[k] != all.front().letters[k]) varying.Insert(frame_.constraints()[k]);
      }
    }
    std::vector<FrictionSolution> fitting;
    std::vector<ContactMode> lasting;
    std::vector<Trend> trends;
    bool end = !Dependent();
    for (const FrictionSolution& word : all) {
      Trend trend = TrendOf(word, varying, [&](const Slack& slack) {
        return slack.value < Nearly(slack.constraint);
      });
      end = end && trend.growth < -kNoticed;
      if (trend.growth > 0) fitting.push_back(word);
      if (trend.growth < -1) continue;
      lasting.push_back(ModeOf(word));
      trends.push_back(std::move(trend));
    }
    if (fitting.size() == 1) return ModeOf(fitting.front());
    // Forces that vanish and stay: which of the words is told does not matter.
    if (SameMotion(trends)) return Simplest(lasting);
    // Feet that begin to slip in space together.
    if (const std::optional<ContactMode> ahead = Ahead(all, border)) return *ahead;
    // Shares decide: the word of a look ahead, or guards tell at once where another one goes on.
    if (by != nullptr && Dependent() && OneMotion(all)) {
      by->springs = true;
      for (const FrictionSolution& word : all) lasting.push_back(ModeOf(word));
      const ContactMode most = MostSticking(lasting);
      if (BeginsInSpace(most)) return most;
      const auto ahead = FindWordAhead(&dynamics_, x_, touching_, most, border);
      return ahead ? ahead->mode : most;
    }
    // Where the motion until now ends and another one is left, this one follows.
    const bool kept = fitting.size() > 1 && !touching_.before.Empty() &&
                      KeptWord(frame_, all, fitting, varying, touching_.before);
    if (!kept && fitting.size() < all.size()) {
      if (const std::optional<ContactMode> ahead = AheadOfAll(all, border)) {
        if (by != nullptr) by->ahead = true;
        return *ahead;
      }
    }
    if (by != nullptr && !end) {
      by->smallest = true;
      by->motions = TellWords(system_, frame_, fitting.empty() ? all : fitting, varying);
      return ChooseWord(frame_, all, fitting.empty() ? all : fitting, varying, touching_.before);
    }
    Refuse(end                              ? FrictionRefusal::Kind::kInconsistent
           : fitting.empty() && Dependent() ? FrictionRefusal::Kind::kIndeterminateForces
                                            : FrictionRefusal::Kind::kIndeterminate,
           (fitting.empty() ? "none of the words goes on to hold: "
                            : "several motions fit, each of which goes on: ") +
               TellWords(system_, frame_, all, varying));
  }

  InverseInertia Inertia() const {
    return InverseInertia(system_, x_.head(nq_), x_.tail(d_), dynamics_.u(), ContactMode());
  }

  bool OneMotion(const std::vector<FrictionSolution>& all) const {
    return std::all_of(all.begin(), all.end(), [&](const FrictionSolution& word) {
      return units_->Largest(word.result - all.front().result) <= kSameMotion * scale_;
    });
  }

  /// Where all words lead to one motion: the one of them that a look ahead tells.
  std::optional<ContactMode> Ahead(const std::vector<FrictionSolution>& all, double border) {
    return OneMotion(all) ? AheadOfAll(all, border) : std::nullopt;
  }
  /// The one that a look ahead along the word that sticks most tells.
  std::optional<ContactMode> AheadOfAll(const std::vector<FrictionSolution>& all, double border) {
    std::optional<ContactMode> along;
    for (const FrictionSolution& word : all) {
      const ContactMode mode = ModeOf(word);
      if (BeginsInSpace(mode)) continue;
      if (!along || mode.Sticking().Size() > along->Sticking().Size()) along = mode;
    }
    if (!along) return std::nullopt;
    const std::optional<WordAhead> ahead = FindWordAhead(&dynamics_, x_, touching_, *along, border);
    if (!ahead) return std::nullopt;
    for (const FrictionSolution& word : all) {
      if (ModeOf(word) == ahead->mode) return ahead->mode;
    }
    return std::nullopt;
  }

  bool BeginsInSpace(const ContactMode& mode) const {
    return !(SlipsInSpace(system_, mode) & touching_.still).Empty();
  }

  /// Of a single word: whether its force, or gap, is used up and goes on to shrink; or, of forces
  /// that are `shared`, whether no share is left in all cones. Where the body turns as it begins to
  /// slip, springs decide what follows that, and no word.
  bool Ends(const FrictionSolution& word, double border, bool shared = false) {
    const ConstraintSet all = touching_.still | touching_.slipping;
    const Trend trend = TrendOf(word, all, [&](const Slack& slack) {
      const bool alone = shared ? slack.cone && dynamics_.shared().Contains(slack.constraint)
                                : !slack.cone || word.springs;  // no other word was looked for
      return alone && slack.value < border * scale_ + 2 * SlackOf(slack.constraint);
    });
    return trend.growth < -kNoticed;
  }

  /// What follows a single word that ends: no word, or, where more contacts depend on each other
  /// than words are tried of, one that a look ahead tells.
  ContactMode Beyond(const FrictionSolution& word, double border, WordConventions* by) {
    const auto ahead = Dependent() && by != nullptr
                           ? FindWordAhead(&dynamics_, x_, touching_, ModeOf(word), border, true)
                           : std::nullopt;
    if (ahead) {
      by->springs = true;
      return ahead->mode;
    }
    if (word.springs) return ModeOf(word);
    Refuse(FrictionRefusal::Kind::kInconsistent,
           "the word '" + ModeOf(word).Word(system_.num_constraints()) +
               "' is the only one that fits, and does not go on to hold: what would have to pull "
               "presses as soon as it lets go");
  }

  bool Dependent() const { return HasDependentRows(KnownPads(frame_.problem()).Rest().G); }

  [[noreturn]] void Refuse(FrictionRefusal::Kind kind, const std::string& what) const {
    std::ostringstream message;
    message << "contacts "
            << (touching_.still | touching_.slipping).ToString(system_.description().constraints)
            << ": " << what;
    if (Dependent() && !AllSlip(frame_) && kind != FrictionRefusal::Kind::kIndeterminate) {
      message << "; the rows of what sticks are dependent, forces are not unique";
      kind = FrictionRefusal::Kind::kIndeterminateForces;
    }
    throw FrictionRefusal(kind, message.str());
  }

  ContactMode ModeOf(const FrictionSolution& word) const { return ModeOfWord(frame_, word); }

  /// Of the normal row of contact k, in comparable units.
  double Rate(std::size_t k) const { return units_->rate()(frame_.problem().Row(k)); }

  /// Of a constraint the value by contact, in these units.
  double Of(const Vector& values, int constraint) const {
    const std::vector<int>& all = frame_.constraints();
    const auto k = std::find(all.begin(), all.end(), constraint) - all.begin();
    return Rate(static_cast<std::size_t>(k)) * values(k);
  }
  double SlackOf(int constraint) const { return Of(frame_.problem().slack, constraint); }
  /// What a slack that is nearly used up is below, of a contact.
  double Nearly(int constraint) const { return kStrict * scale_ + 2 * SlackOf(constraint); }

  /// What has to stay positive at the contacts of `varying`, where the motion of `mode` is at x.
  std::vector<Slack> Slacks(const Vector& x, const ContactMode& mode, const ConstraintSet& varying,
                            bool turns) {
    dynamics_.Evaluate(x, mode);
    const Vector& force = dynamics_.force();
    system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
    const Vector rate = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
    std::vector<Slack> slacks;
    for (std::size_t k = 0; k < frame_.constraints().size(); ++k) {
      const int i = frame_.constraints()[k];
      if (!varying.Contains(i)) continue;
      const FrictionContact& contact = frame_.problem().contacts[k];
      const int row = frame_.problem().Row(k);
      const double gain = Rate(k) * frame_.problem().G(row, row);
      const Letter letter = mode.LetterOf(i);
      if (letter == Letter::kOpen) {
        slacks.push_back({i, Rate(k) * rate(i), false});
        continue;
      }
      const int tangential = contact.dimension > 0 ? system_.friction()[i].row : 0;
      if (dynamics_.shared().Contains(i)) {
        slacks.push_back({i, gain * dynamics_.shared_margin(), letter == Letter::kStick});
      } else if (letter == Letter::kStick && std::isfinite(contact.coefficient)) {
        const double cone =
            contact.coefficient * force(i) - force.segment(tangential, contact.dimension).norm();
        const double unit = units_->force()(row) / units_->force()(row + 1);
        slacks.push_back({i, gain * unit * cone, true});
        continue;
      } else {
        slacks.push_back({i, gain * force(i), false});
      }
      const bool begins = !contact.slips && contact.dimension == 1 && letter != Letter::kStick;
      if (begins) {
        slacks.push_back({i, SlipSign(letter) * units_->rate()(row + 1) * rate(tangential), false});
      } else if (turns && !contact.slips && contact.dimension == 2 && letter == Letter::kSlip) {
        const Vector slip = terms_.jacobian.middleRows<2>(tangential) * x.tail(d_);
        slacks.push_back({i, slip.normalized().dot(rate.segment<2>(tangential)), false});
      }
    }
    return slacks;
  }

  /// x, with a slip too small to matter where one begins in space: then it has the
  /// direction of the word.
  Vector Begun(const FrictionSolution& word) const {
    const Vector begun = BegunMotion(frame_, word, kBegun);
    Vector x = x_;
    if (begun.size() > 0) x.tail(d_) += begun;
    return x;
  }

  /// How the slacks of `varying` that `nearly` tells of grow along the motion of the word.
  template <class Nearly>
  Trend TrendOf(const FrictionSolution& word, const ConstraintSet& varying, const Nearly& nearly) {
    const ContactMode mode = ModeOf(word);
    const Vector x = Begun(word);
    Trend trend;
    trend.accelerations.resize(d_, 2);
    const std::vector<Slack> now = Slacks(x, mode, varying, word.turns);
    trend.accelerations.col(0) = dynamics_.acceleration();
    const Vector field = dynamics_.Field(x, mode).head(2 * d_);
    const double ahead = kAhead * TimeToMove(system_.space(), x_, field);
    const std::vector<Slack> later =
        Slacks(system_.Perturb(x, ahead * field), mode, varying, word.turns);
    trend.accelerations.col(1) = dynamics_.acceleration();
    for (std::size_t k = 0; k < now.size(); ++k) {
      if (!nearly(now[k])) continue;
      const double rounding = 1e-300 + Of(rounding_, now[k].constraint);
      trend.growth = std::min(trend.growth, (later[k].value - now[k].value) / rounding);
    }
    return trend;
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector x_;
  const TouchingContacts touching_;
  const int nq_, d_;
  FrictionFrame frame_;
  double scale_ = 0;  // largest acceleration of a row
  std::optional<RowUnits> units_;
  std::vector<Letter> before_;
  Vector rounding_;  // of accelerations, by contact
  ConstraintTerms terms_;
};

}  // namespace

ContactMode SelectWord(ContactDynamics* dynamics, const VectorRef& x,
                       const TouchingContacts& touching, double border, WordConventions* by) {
  if ((touching.still | touching.slipping).Empty()) return ContactMode();
  return Words(dynamics, x, touching).Find(border, by);
}

}  // namespace contact_flow
