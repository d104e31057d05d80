// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/stabilizing_feedback.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "balance.h"
#include "common_quadratic_norm.h"
#include "cone_interior.h"
#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/section.h"
#include "feedback_gains.h"
#include "gain_of_words.h"
#include "loop_growth.h"
#include "stability_certificate.h"

namespace contact_flow {
namespace {

constexpr std::size_t kMaxFaces = 8;   // 2⁸ regions of a law
constexpr std::size_t kMaxStarts = 9;  // of descents
constexpr int kMaxRounds = 10;         // of kinks and norm in turn
constexpr double kWorthwhile = 1e-3;   // of the rate, relative, for which a round is worth it
constexpr int kMaxWordRounds = 4;      // of gains and the words that they do not contract
constexpr double kSameFace = 1e-9;     // distance of unit normals
constexpr double kRankOne = 1e-6;      // a jump, relative, that is more than one of its face

Matrix Stacked(const Matrix& above, const Matrix& below) {
  Matrix rows(above.rows() + below.rows(), below.cols());
  rows << above, below;
  return rows;
}

/// A law with its closed loop and the norm in which that contracts best.
struct Candidate {
  PiecewiseLinearMap law, closed;
  Matrix P;
  double rate = 0;
};

Candidate Judge(const PiecewiseLinearMap& step, const PiecewiseLinearMap& law, const Matrix& P,
                const FeedbackOptions& options) {
  Candidate candidate{law, ClosedLoop(step, law), P, 0};
  std::vector<Matrix> matrices;
  for (const LinearPiece& piece : candidate.closed.pieces()) matrices.push_back(piece.matrix);
  candidate.rate = QuadraticRate(matrices, P);
  const CommonQuadraticNorm better =
      FindCommonQuadraticNorm(matrices, options.good_enough, options.stability.cancelled);
  if (better.rate < candidate.rate) {
    candidate.P = better.P;
    candidate.rate = better.rate;
  }
  return candidate;
}

/// κ = K x, by one norm for all pieces.
Candidate Linear(const PiecewiseLinearMap& step, const FeedbackOptions& options) {
  const GainsAndNorm found =
      FindGainsAndNorm(step, false, options.good_enough, options.stability.cancelled);
  return Judge(step, PiecewiseLinearMap::Linear(found.gains.front()), found.P, options);
}

/// A face of a map f(x, w), and how the matrices jump there: those on its negative side are larger
/// by a (C D).
struct Face {
  Matrix row;                                    ///< (C D), of length 1
  std::vector<std::pair<Vector, Matrix>> jumps;  ///< a [n], and B of the negative side
};

/// All faces of `step`, each once.
std::vector<Face> FacesOf(const PiecewiseLinearMap& step) {
  const int n = step.rows(), m = step.cols() - n;
  std::vector<Face> faces;
  const auto side = [](const LinearPiece& piece, const Matrix& row) {
    for (Eigen::Index r = 0; r < piece.cone.rows(); ++r) {
      if ((piece.cone.row(r) - row).norm() < kSameFace) return 1;
      if ((piece.cone.row(r) + row).norm() < kSameFace) return -1;
    }
    return 0;
  };
  for (const LinearPiece& piece : step.pieces()) {
    for (Eigen::Index r = 0; r < piece.cone.rows(); ++r) {
      const Matrix row = piece.cone.row(r);
      const bool known = std::any_of(faces.begin(), faces.end(), [&](const Face& face) {
        return std::min((face.row - row).norm(), (face.row + row).norm()) < kSameFace;
      });
      if (!known) faces.push_back({row, {}});
    }
  }
  for (Face& face : faces) {
    for (const LinearPiece& above : step.pieces()) {
      if (side(above, face.row) <= 0) continue;
      for (const LinearPiece& below : step.pieces()) {
        if (side(below, face.row) >= 0) continue;
        const Matrix jump = below.matrix - above.matrix;
        const Vector a = jump * face.row.transpose();
        if (a.norm() > 0 && (jump - a * face.row).norm() <= kRankOne * a.norm()) {
          face.jumps.push_back({a, below.matrix.rightCols(m)});
        }
      }
    }
  }
  return faces;
}

/// The k_h that make what is left of the jumps, a − B k, smallest in the norm P [m×H].
Matrix KinksAgainst(const std::vector<Face>& faces, const Matrix& P, int m) {
  const Matrix root = Eigen::LLT<Matrix>(P).matrixU();
  Matrix kinks = Matrix::Zero(m, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t h = 0; h < faces.size(); ++h) {
    Matrix effects(0, m), jumps(0, 1);
    for (const auto& [a, B] : faces[h].jumps) {
      effects = Stacked(effects, root * B);
      jumps = Stacked(jumps, root * a);
    }
    if (effects.rows() == 0) continue;
    kinks.col(static_cast<Eigen::Index>(h)) =
        effects.completeOrthogonalDecomposition().solve(jumps);
  }
  return kinks;
}

/// (x, v) ↦ (x, v + Σ_h k_h max(0, −(C_h x + D_h v))).
PiecewiseLinearMap KinkedInput(const std::vector<Face>& faces, const Matrix& kinks, int n) {
  const Eigen::Index m = kinks.rows(), size = n + m;
  std::vector<LinearPiece> pieces;
  for (int code = 0; code < 1 << faces.size(); ++code) {
    LinearPiece piece;
    piece.cone.resize(static_cast<Eigen::Index>(faces.size()), size);
    piece.matrix = Matrix::Identity(size, size);
    for (std::size_t h = 0; h < faces.size(); ++h) {
      const auto r = static_cast<Eigen::Index>(h);
      const bool below = code >> h & 1;
      piece.cone.row(r) = below ? Matrix(-faces[h].row) : faces[h].row;
      if (below) piece.matrix.bottomRows(m) -= kinks.col(r) * faces[h].row;
    }
    if (HasInterior(piece.cone)) pieces.push_back(std::move(piece));
  }
  return PiecewiseLinearMap(std::move(pieces));
}

/// κ with a kink on each face, in rounds: kinks in a norm, then gain and norm at once.
Candidate Piecewise(const PiecewiseLinearMap& step, const Candidate& linear,
                    const FeedbackOptions& options) {
  const int n = step.rows(), m = step.cols() - n;
  const std::vector<Face> faces = FacesOf(step);
  if (faces.size() > kMaxFaces) {
    throw std::invalid_argument("the map has " + std::to_string(faces.size()) +
                                " faces, a piecewise-linear feedback is sought for at most " +
                                std::to_string(kMaxFaces));
  }
  BudgetStage stage("the kinks of a feedback");
  Candidate best = linear;
  for (int round = 0; round < kMaxRounds && best.rate > options.good_enough; ++round) {
    stage.Next();
    const PiecewiseLinearMap input = KinkedInput(faces, KinksAgainst(faces, best.P, m), n);
    const GainsAndNorm found = FindGainsAndNorm(step.After(input), false, options.good_enough,
                                                options.stability.cancelled);
    Matrix start(n + m, n);
    start << Matrix::Identity(n, n), found.gains.front();
    Matrix end = Matrix::Zero(n + m, m);
    end.bottomRows(m).setIdentity();
    Candidate next = Judge(step, InBases(input, end, start), found.P, options);
    if (!(next.rate < (1 - kWorthwhile) * best.rate)) break;
    best = std::move(next);
  }
  return best;
}

/// The certificate of a candidate: its norm, or whatever proves its loop stable.
StabilizingFeedback Decide(const Candidate& candidate, const StabilityOptions& options) {
  StabilizingFeedback result;
  result.law = candidate.law;
  result.closed = candidate.closed;
  result.rate = candidate.rate;
  result.certificate.test = StabilityTest::kQuadraticNorm;
  result.certificate.bound = candidate.rate;
  result.certificate.norm = candidate.P;
  std::ostringstream message;
  message << "stable: every piece of the closed loop contracts in one quadratic norm, by "
          << candidate.rate;
  result.certified = VerifyCertificate(result.closed, result.certificate, options);
  if (!result.certified) {
    const StabilityReport report = AssessStability(result.closed, options);
    result.certificate = report.certificate;
    result.certified = report.verdict == StabilityVerdict::kStable &&
                       VerifyCertificate(result.closed, report.certificate, options);
    message.str("");
    if (!result.certified) {
      message << "no certificate: the smallest rate found in one quadratic norm is "
              << candidate.rate << ", and the loop is ";
    }
    message << report.message;
  }
  result.message = message.str();
  return result;
}

/// One gain for all pieces where no norm is common to its loops: that of the least certified growth
/// among those that words suggest. Words are those that were met, each piece first.
Matrix GainByWords(const PiecewiseLinearMap& step, const Matrix& first, bool is_first_good,
                   const FeedbackOptions& options) {
  // The descent has several ends: from the gain for all pieces, and from that for each alone.
  std::vector<Matrix> starts = {first};
  std::vector<std::vector<int>> words;
  for (std::size_t i = 0; i < step.pieces().size(); ++i) {
    words.push_back({static_cast<int>(i)});
    if (starts.size() == kMaxStarts) continue;
    starts.push_back(FindGainsAndNorm(PiecewiseLinearMap::Linear(step.pieces()[i].matrix), false,
                                      options.good_enough, options.stability.cancelled)
                         .gains.front());
  }
  const StabilityOptions& stability = options.stability;
  Matrix best = first;
  double least = std::numeric_limits<double>::infinity();
  if (is_first_good) {
    least = GrowthOf(step, first, GrowthAlong(step, words, first), stability).above;
  }
  for (int round = 0; round < kMaxWordRounds; ++round) {
    const GainOfWords found = FindGainOfWords(step, words, starts, stability.cancelled);
    const LoopGrowth growth = GrowthOf(step, found.gain, found.growth, stability);
    if (growth.above < least) {
      least = growth.above;
      best = found.gain;
    }
    if (growth.word.empty()) break;
    words.push_back(growth.word);
    starts = {found.gain};
  }
  return best;
}

StabilizingFeedback Search(const PiecewiseLinearMap& step, const FeedbackOptions& options) {
  const Candidate linear = Linear(step, options);
  if (step.pieces().size() == 1) return Decide(linear, options.stability);
  if (options.piecewise) return Decide(Piecewise(step, linear, options), options.stability);
  const StabilizingFeedback result = Decide(linear, options.stability);
  const bool has_norm = result.certificate.test == StabilityTest::kQuadraticNorm;
  if (result.certified && has_norm) return result;
  const Matrix gain =
      GainByWords(step, linear.law.pieces().front().matrix, result.certified, options);
  const StabilizingFeedback other =
      Decide(Judge(step, PiecewiseLinearMap::Linear(gain), linear.P, options), options.stability);
  return other.certified ? other : result;
}

}  // namespace

PiecewiseLinearMap ClosedLoop(const PiecewiseLinearMap& step, const PiecewiseLinearMap& law) {
  const int n = law.cols();
  if (step.cols() != n + law.rows()) {
    throw std::invalid_argument("a law from " + std::to_string(n) + " to " +
                                std::to_string(law.rows()) + " dimensions for a map on " +
                                std::to_string(step.cols()));
  }
  std::vector<LinearPiece> graph = law.pieces();
  for (LinearPiece& piece : graph) {
    piece.matrix = Stacked(Matrix::Identity(n, n), piece.matrix);
  }
  if (graph.size() > 1) return step.After(PiecewiseLinearMap(std::move(graph)));
  return InBases(step, Matrix::Identity(step.rows(), step.rows()), graph.front().matrix);
}

StabilizingFeedback FindStabilizingFeedback(const PiecewiseLinearMap& step,
                                            const FeedbackOptions& options) {
  CheckOptions(options.stability);
  if (step.pieces().empty() || step.rows() == 0 || step.cols() <= step.rows()) {
    throw std::invalid_argument("a feedback needs a map of states and inputs to states");
  }
  // In units in which states pass as much as they get and inputs have effects of 1.
  const Vector states = BalancedSizes(step);
  Vector all(step.cols());
  all << states, Vector::Ones(step.cols() - step.rows());
  const Vector inputs = EffectsOfInputs(InSizes(step, states, all)).cwiseInverse();
  all.tail(inputs.size()) = inputs;
  const MapConsistency consistency = CheckConsistency(step, options.stability.consistency);
  if (!consistency.usable) {
    StabilizingFeedback none;
    none.message = "no feedback: " + consistency.message;
    return none;
  }
  StabilizingFeedback found = Search(InSizes(step, states, all), options);
  found.law = InSizes(found.law, inputs.cwiseInverse(), states.cwiseInverse());
  found.closed = InSizes(found.closed, states.cwiseInverse(), states.cwiseInverse());
  found.certificate = CertificateInUnits(found.certificate, states);
  return found;
}

}  // namespace contact_flow
