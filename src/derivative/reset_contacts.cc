// SPDX-License-Identifier: BSD-3-Clause
// Which contacts an impact of a perturbed run is shared among, and what those that rest let w do.
#include <Eigen/QR>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "frictional_reset.h"
#include "src/dynamics/word_margins.h"

namespace contact_flow {
namespace {

/// A contact that rests, and moves with less than this part of the speed of approach, may rest,
/// both in the kinetic metric.
constexpr double kBrushed = 1e-6;
/// Coordinates are moved by this for what vanishes at one state alone.
constexpr double kMovedBeside = 1e-3;
/// The two derivatives differ by no more than this, relative, where a push moves others by less.
constexpr double kPushedAside = 1e-5;

/// Whether a push of contact `one` moves rows that others hold in the impact: along its column of W
/// where it slips, else along any of its rows.
bool PushMovesOthers(const FrictionProblem& problem, const FrictionSolution& solution,
                     std::size_t one) {
  const FrictionContact& contact = problem.contacts[one];
  const int first = problem.Row(one), dimension = contact.dimension;
  Matrix push = Matrix::Zero(problem.b.size(), 1 + dimension);
  push.middleRows(first, 1 + dimension).setIdentity();
  if (Slips(solution.letters[one])) {
    push.block(first + 1, 0, dimension, 1) =
        -contact.coefficient * solution.directions[one].head(dimension);
    push.conservativeResize(Eigen::NoChange, 1);
  }
  const Matrix moved = problem.G * push;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const Letter letter = solution.letters[k];
    if (k == one || letter == Letter::kOpen) continue;
    const int held = letter == Letter::kStick ? 1 + problem.contacts[k].dimension : 1;
    for (int row = problem.Row(k); row < problem.Row(k) + held; ++row) {
      for (Eigen::Index j = 0; j < push.cols(); ++j) {
        const double size = std::sqrt(problem.G(row, row) * problem.G(first + j, first + j));
        if (std::abs(moved(row, j)) > kPushedAside * size) return true;
      }
    }
  }
  return false;
}

/// What the normal rows of contacts meet: whether any other row of the frame, by contact.
std::vector<bool> Meetings(const FrictionFrame& frame) {
  const FrictionProblem& problem = frame.problem();
  std::vector<bool> meets;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    meets.push_back((problem.G.row(problem.Row(k)).array() != 0).count() > 1);
  }
  return meets;
}

}  // namespace

/// The contacts among which an impact is shared: not those that rest, and whose normal rows meet no
/// other row here and beside, like the pads of joints with friction. These get no impulse, and
/// bound none. What meets none here alone does where a perturbed run is hit.
ConstraintSet FrictionalReset::Sharing(const MechanicalSystem& system,
                                       const InverseInertia& inertia, const Vector& x,
                                       ConstraintSet touching, ConstraintSet persisting) {
  const FrictionFrame frame(system, inertia, touching);
  const std::vector<bool> here = Meetings(frame);
  ConstraintSet sharing = touching;
  std::vector<bool> beside;
  for (std::size_t k = 0; k < here.size(); ++k) {
    const int i = frame.constraints()[k];
    if (here[k] || !persisting.Contains(i)) continue;
    if (beside.empty()) {
      const int nq = system.num_positions(), d = system.dof();
      Vector w = Vector::Zero(2 * d);
      for (int j = 0; j < d; ++j) w(j) = kMovedBeside * std::cos(1.0 + j);
      const Vector moved = system.Perturb(x, w);
      const InverseInertia there(system, moved.head(nq), moved.tail(d));
      beside = Meetings(FrictionFrame(system, there, touching));
    }
    if (!beside[k]) sharing.Erase(i);
  }
  return sharing;
}

void FrictionalReset::CheckBrushed(const FrictionSolution& solution, int hit, double scale) const {
  const FrictionProblem& problem = frame_.problem();
  const std::vector<std::string>& names = system_.description().constraints;
  double approach = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int row = problem.Row(k);
    if (frame_.constraints()[k] != hit) continue;
    approach = std::abs(problem.b(row)) / std::sqrt(problem.G(row, row));
  }
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int i = frame_.constraints()[k], row = problem.Row(k);
    const double gain = problem.G(row, row);
    const double moved =
        solution.letters[k] == Letter::kOpen ? solution.result(row) : gain * solution.force(row);
    const bool border = moved <= border_ * scale,
               clear = moved > kBrushed * approach * std::sqrt(gain);
    if (!persisting_.Contains(i) || border || clear) continue;
    // Lifted, what is pressed afterwards comes back at once: as if it was held, but for what a push
    // moves of the others, which only hold on while the impact lasts.
    if (after_.Contains(i) && !PushMovesOthers(problem, solution, k)) continue;
    std::ostringstream message;
    message << "at t = " << t_ << " s the impact of '" << names[hit] << "' moves '" << names[i]
            << "', which rests, so little that perturbations of that size decide whether it does: "
            << "there are two derivatives, and neither holds for both";
    throw std::domain_error(message.str());
  }
}

/// An orthonormal basis of the gradients of gaps and rates of what persists [2d+k × ·].
Matrix FrictionalReset::KeptRows(const Matrix& A, const Matrix& rate,
                                 const ParameterJacobian& by_parameter) const {
  if (persisting_.Empty()) return Matrix::Zero(size_, 0);
  Matrix rows = Matrix::Zero(size_, 2 * persisting_.Size());
  Eigen::Index k = 0;
  for (int i : persisting_) {
    rows.col(k).head(d_) = A.row(i).transpose();
    if (by_parameter.gap.size() > 0) {
      rows.col(k).tail(by_parameter.gap.cols()) = by_parameter.gap.row(i).transpose();
    }
    rows.col(k++).normalize();
    rows.col(k++) = rate.row(i).transpose().normalized();
  }
  const Eigen::ColPivHouseholderQR<Matrix> factor(rows);
  return factor.householderQ() * Matrix::Identity(size_, factor.rank());
}

}  // namespace contact_flow
