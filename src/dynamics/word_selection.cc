// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/word_selection.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <sstream>

namespace contact_flow {
namespace {

/// A look ahead moves the state by this part of its size.
constexpr double kAhead = 1e-6;
/// A slip that begins in space, for its direction [m/s].
constexpr double kBegun = 1e-9;
/// Inequalities with more than this slack, relative, hold for a while.
constexpr double kStrict = 1e-7;
/// Motions that differ by less than this, relative, are one.
constexpr double kSameMotion = 1e-8;
/// Rows are dependent below this eigenvalue of their normalized Gram matrix.
constexpr double kDependent = 1e-11;
/// Energy that an impact may gain by rounding, relative.
constexpr double kEnergyRounding = 1e-10;

/// The guards of one word that hold at a touching contact: what has to stay positive.
struct Slack {
  int constraint;
  double value;
};

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
    problem.b = A * inertia.FreeAcceleration() + frame_.bias();
    scale_ = problem.b.size() > 0 ? problem.b.cwiseAbs().maxCoeff() : 0;
    int row = 0;
    for (std::size_t k = 0; k < frame_.constraints().size(); ++k) {
      const int i = frame_.constraints()[k];
      FrictionContact& contact = problem.contacts[k];
      if (touching.slipping.Contains(i) && contact.dimension > 0) {
        contact.slips = true;
        if (contact.dimension == 1) {
          contact.direction(0) = touching.slipping.LetterOf(i) == Letter::kBackward ? -1 : 1;
        } else {
          contact.direction = (A.middleRows<2>(row + 1) * x.tail(d_)).normalized();
        }
      }
      row += 1 + contact.dimension;
    }
  }

  ContactMode Find(double border) {
    const std::vector<FrictionSolution> all = SolveFriction(frame_.problem(), border);
    if (all.empty()) Refuse(FrictionRefusal::Kind::kInconsistent, "no contact forces exist");
    for (const FrictionSolution& word : all) {
      if (!word.many) continue;
      Refuse(FrictionRefusal::Kind::kIndeterminateForces,
             "in the word '" + ModeOf(word).Word(system_.num_constraints()) +
                 "' the motion depends on how forces are shared");
    }
    if (all.size() == 1) return ModeOf(all.front());
    ContactMode varying;
    for (std::size_t k = 0; k < frame_.constraints().size(); ++k) {
      for (const FrictionSolution& word : all) {
        if (word.letters[k] != all.front().letters[k]) varying.Insert(frame_.constraints()[k]);
      }
    }
    std::vector<ContactMode> fitting;
    for (const FrictionSolution& word : all) {
      if (GoesOn(word, varying)) fitting.push_back(ModeOf(word));
    }
    if (fitting.size() == 1) return fitting.front();
    std::string words;
    const int n = system_.num_constraints();
    for (const FrictionSolution& word : all) words += " '" + ModeOf(word).Word(n) + "'";
    Refuse(FrictionRefusal::Kind::kIndeterminate,
           (fitting.empty() ? "no one of the words" : "several of the words") + words +
               " goes on to hold");
  }

 private:
  InverseInertia Inertia() const {
    return InverseInertia(system_, x_.head(nq_), x_.tail(d_), dynamics_.u(), ContactMode());
  }

  bool Dependent() const {
    const Matrix& G = frame_.problem().G;
    if (G.size() == 0) return false;
    const Vector unit = G.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Matrix> values(unit.asDiagonal() * G * unit.asDiagonal());
    return values.eigenvalues().minCoeff() < kDependent;
  }

  [[noreturn]] void Refuse(FrictionRefusal::Kind kind, const std::string& what) const {
    std::ostringstream message;
    message << "contacts "
            << (touching_.still | touching_.slipping).ToString(system_.description().constraints)
            << ": " << what;
    if (Dependent()) {
      message << "; the rows of what sticks are dependent, forces are not unique";
      kind = FrictionRefusal::Kind::kIndeterminateForces;
    }
    throw FrictionRefusal(kind, message.str());
  }

  ContactMode ModeOf(const FrictionSolution& word) const {
    ContactMode mode;
    for (std::size_t k = 0; k < frame_.constraints().size(); ++k) {
      const Letter letter = word.letters[k];
      const bool free = letter != Letter::kOpen && frame_.problem().contacts[k].dimension == 0;
      mode.Set(frame_.constraints()[k], free ? Letter::kSlip : letter);
    }
    return mode;
  }

  /// What has to stay positive at the contacts of `varying`, where the motion of `mode` is at x.
  std::vector<Slack> Slacks(const Vector& x, ContactMode mode, ContactMode varying) {
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
      const double gain = frame_.problem().G(row, row);
      const Letter letter = mode.LetterOf(i);
      if (letter == Letter::kOpen) {
        slacks.push_back({i, rate(i)});
        continue;
      }
      const int tangential = contact.dimension > 0 ? system_.friction()[i].row : 0;
      if (dynamics_.shared().Contains(i)) {
        slacks.push_back({i, gain * dynamics_.shared_margin()});
      } else if (letter == Letter::kStick && std::isfinite(contact.coefficient)) {
        slacks.push_back({i, gain * (contact.coefficient * force(i) -
                                     force.segment(tangential, contact.dimension).norm())});
        continue;
      } else {
        slacks.push_back({i, gain * force(i)});
      }
      const bool begins = !contact.slips && contact.dimension == 1 && letter != Letter::kStick;
      if (begins) {
        slacks.push_back({i, (letter == Letter::kBackward ? -1 : 1) * rate(tangential)});
      }
    }
    return slacks;
  }

  /// x, with a slip too small to matter where one begins in space: then it has the
  /// direction of the word.
  Vector Begun(const FrictionSolution& word) const {
    const FrictionProblem& problem = frame_.problem();
    std::vector<int> rows;
    std::vector<double> rates;
    bool begun = false;
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      if (word.letters[k] == Letter::kOpen) continue;
      const int row = problem.Row(k), dimension = problem.contacts[k].dimension;
      rows.push_back(row);
      rates.push_back(0);
      const bool begins = word.letters[k] == Letter::kSlip && dimension == 2 &&
                          touching_.still.Contains(frame_.constraints()[k]);
      begun = begun || begins;
      if (word.letters[k] != Letter::kStick && !begins) continue;
      for (int j = 0; j < dimension; ++j) {
        rows.push_back(row + 1 + j);
        rates.push_back(begins ? kBegun * word.directions[k](j) : 0);
      }
    }
    if (!begun) return x_;
    const auto m = static_cast<Eigen::Index>(rows.size());
    Matrix G(m, m), reach(d_, m);
    for (Eigen::Index r = 0; r < m; ++r) {
      reach.col(r) = frame_.reach().col(rows[static_cast<std::size_t>(r)]);
      for (Eigen::Index c = 0; c < m; ++c) {
        G(r, c) = problem.G(rows[static_cast<std::size_t>(r)], rows[static_cast<std::size_t>(c)]);
      }
    }
    Vector x = x_;
    x.tail(d_) += reach * G.completeOrthogonalDecomposition().solve(Vector::Map(rates.data(), m));
    return x;
  }

  /// Whether no slack that is nearly used up shrinks along the motion of the word.
  bool GoesOn(const FrictionSolution& word, ContactMode varying) {
    const ContactMode mode = ModeOf(word);
    const Vector x = Begun(word);
    const std::vector<Slack> now = Slacks(x, mode, varying);
    const Vector field = dynamics_.Field(x, mode).head(2 * d_);
    const double step =
        kAhead * (1 + x_.cwiseAbs().maxCoeff()) / (1e-300 + field.cwiseAbs().maxCoeff());
    const std::vector<Slack> later = Slacks(system_.Perturb(x, step * field), mode, varying);
    for (std::size_t k = 0; k < now.size(); ++k) {
      if (now[k].value < kStrict * scale_ && !(later[k].value > now[k].value)) return false;
    }
    return true;
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector x_;
  const TouchingContacts touching_;
  const int nq_, d_;
  FrictionFrame frame_;
  double scale_ = 0;  // largest acceleration of a row
  ConstraintTerms terms_;
};

}  // namespace

FrictionFrame::FrictionFrame(const MechanicalSystem& system, const InverseInertia& inertia,
                             ContactMode contacts)
    : system_(system) {
  for (int i : contacts) {
    const Friction friction = system.HasFriction() ? system.friction()[i] : Friction();
    FrictionContact contact;
    contact.coefficient = friction.coefficient;
    contact.dimension = friction.coefficient > 0 ? friction.dimension : 0;
    constraints_.push_back(i);
    system_rows_.push_back(i);
    for (int k = 0; k < contact.dimension; ++k) system_rows_.push_back(friction.row + k);
    problem_.contacts.push_back(contact);
  }
  const auto m = static_cast<Eigen::Index>(system_rows_.size());
  rows_.resize(m, system.dof());
  bias_.resize(m);
  for (Eigen::Index r = 0; r < m; ++r) {
    rows_.row(r) = inertia.terms().jacobian.row(system_rows_[static_cast<std::size_t>(r)]);
    bias_(r) = inertia.terms().bias(system_rows_[static_cast<std::size_t>(r)]);
  }
  reach_ = inertia * rows_.transpose();
  problem_.G = rows_ * reach_;
}

Vector FrictionFrame::Spread(const Vector& values) const {
  Vector all = Vector::Zero(system_.num_rows());
  for (std::size_t r = 0; r < system_rows_.size(); ++r) {
    all(system_rows_[r]) = values(static_cast<Eigen::Index>(r));
  }
  return all;
}

ContactMode SelectWord(ContactDynamics* dynamics, const VectorRef& x,
                       const TouchingContacts& touching, double border) {
  if ((touching.still | touching.slipping).Empty()) return ContactMode();
  return Words(dynamics, x, touching).Find(border);
}

FrictionalImpact SolveFrictionalImpact(const MechanicalSystem& system, const VectorRef& q,
                                       const VectorRef& v_minus, ContactMode touching) {
  const InverseInertia inertia(system, q, v_minus);
  FrictionFrame frame(system, inertia, touching);
  FrictionProblem& problem = frame.problem();
  const Vector before = frame.rows() * v_minus;
  problem.b = before;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    problem.b(problem.Row(k)) *= 1 + system.restitution()(frame.constraints()[k]);
  }
  const std::string names = touching.ToString(system.description().constraints);
  const std::vector<FrictionSolution> all = SolveFriction(problem);
  if (all.empty()) {
    throw FrictionRefusal(FrictionRefusal::Kind::kNoImpact,
                          "no impulses of the contacts " + names + " end the impact: they jam");
  }
  const FrictionSolution& found = all.front();
  const double scale = problem.b.cwiseAbs().maxCoeff();
  for (const FrictionSolution& other : all) {
    const double apart = (other.result - found.result).cwiseAbs().maxCoeff();
    if (!other.many && apart <= kSameMotion * scale) continue;
    throw FrictionRefusal(FrictionRefusal::Kind::kAmbiguousImpact,
                          "several impulses of the contacts " + names + " end the impact");
  }
  FrictionalImpact impact;
  impact.result.v_plus = v_minus + frame.reach() * found.force;
  impact.result.impulse = frame.Spread(found.force);
  impact.result.impulse.segment(system.num_constraints(), system.num_bilateral()) =
      inertia.BilateralForce(Matrix(frame.rows().transpose() * found.force)).col(0);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (found.letters[k] == Letter::kOpen) continue;
    const bool free = problem.contacts[k].dimension == 0;
    impact.word.Set(frame.constraints()[k], free ? Letter::kSlip : found.letters[k]);
    impact.result.hit.Insert(frame.constraints()[k]);
  }
  impact.energy_change = 0.5 * found.force.dot(before + frame.rows() * impact.result.v_plus);
  const double energy = 0.5 * v_minus.dot(inertia.mass() * v_minus);
  if (impact.energy_change > kEnergyRounding * energy) {
    std::ostringstream message;
    message << "the impact of the contacts " << names << " would add " << impact.energy_change
            << " J (Newton's restitution with friction)";
    throw FrictionRefusal(FrictionRefusal::Kind::kEnergyGain, message.str());
  }
  if (!impact.result.v_plus.allFinite()) {
    throw std::domain_error("the velocity after the impact is not finite");
  }
  return impact;
}

}  // namespace contact_flow
