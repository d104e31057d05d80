// SPDX-License-Identifier: BSD-3-Clause
#include "stability_certificate.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <utility>

#include "balance.h"
#include "common_quadratic_norm.h"
#include "cone_interior.h"
#include "contact_flow/budget.h"
#include "word.h"

namespace contact_flow {
namespace {

constexpr double kRounding = 1e-9;         // a claimed bound may be this much too good
constexpr double kLargestCondition = 1e8;  // of T with columns of length 1
/// Longer words are rejected: each piece of one is a call inside the call for the piece before.
constexpr std::size_t kLongestWord = 1000;

bool AreWordsOf(const PiecewiseLinearMap& map, const std::vector<std::vector<int>>& words) {
  const int count = static_cast<int>(map.pieces().size());
  return std::all_of(words.begin(), words.end(), [count](const std::vector<int>& word) {
    return !word.empty() && word.size() <= kLongestWord &&
           std::all_of(word.begin(), word.end(), [count](int i) { return i >= 0 && i < count; });
  });
}

/// Words by their beginnings, which takes room for each letter once.
class WordTree {
 public:
  explicit WordTree(const std::vector<std::vector<int>>& words) {
    double letters = 0;
    for (const std::vector<int>& word : words) letters += static_cast<double>(word.size());
    AskMemory(kLetterBytes * letters, "the words of a certificate");
    for (const std::vector<int>& word : words) {
      AskBudget();
      std::size_t at = 0;
      for (int piece : word) {
        const auto [place, is_new] = nodes_[at].next.emplace(piece, nodes_.size());
        at = place->second;
        if (is_new) nodes_.emplace_back();
      }
      nodes_[at].ends = true;
    }
  }
  struct Node {
    std::map<int, std::size_t> next;
    bool ends = false;  // a word does
  };
  const Node& root() const { return nodes_.front(); }
  /// The node that a piece leads to; null: no word goes on like that.
  const Node* Follow(const Node& node, int piece) const {
    const auto place = node.next.find(piece);
    return place == node.next.end() ? nullptr : &nodes_[place->second];
  }

 private:
  static constexpr double kLetterBytes = 120;
  std::deque<Node> nodes_{1};
};

double LargestNorm(const PiecewiseLinearMap& map, StabilityTest test) {
  double largest = 0;
  for (const LinearPiece& piece : map.pieces()) {
    AskBudget();
    const Matrix& A = piece.matrix;
    const double norm = test == StabilityTest::kNormOne ? A.cwiseAbs().colwise().sum().maxCoeff()
                        : test == StabilityTest::kNormTwo
                            ? Eigen::JacobiSVD<Matrix>(A).singularValues()(0)
                            : A.cwiseAbs().rowwise().sum().maxCoeff();
    largest = std::max(largest, norm);
  }
  return largest;
}

/// Is every feasible word that is not a proper prefix of one of `words` among them,
/// and contracting?
class WordCheck {
 public:
  WordCheck(const PiecewiseLinearMap& map, const StabilityCertificate& certificate,
            const StabilityOptions& options)
      : moved_(ChangeCoordinates(map, certificate.norm)),
        bound_(certificate.bound + kRounding),
        options_(options),
        budget_{options.max_linear_programs, 0},
        words_(certificate.words) {}

  bool Holds() { return Holds(EmptyWord(moved_.cols()), words_.root()); }

 private:
  bool Holds(const Word& word, const WordTree::Node& node) {
    for (std::size_t i = 0; i < moved_.pieces().size(); ++i) {
      if (++examined_ > options_.max_words || !budget_.Take(1)) return false;
      if (options_.cancelled && options_.cancelled()) return false;
      AskBudget();
      const Word next = Append(moved_, word, static_cast<int>(i));
      if (!HasInterior(next.cone)) continue;
      const WordTree::Node* const there = words_.Follow(node, static_cast<int>(i));
      if (there == nullptr) return false;  // neither done with nor to be continued
      if (there->ends) {
        if (!(GainBound(next, bound_, false, &budget_) <= bound_)) return false;
      } else if (!Holds(next, *there)) {
        return false;
      }
    }
    return true;
  }

  const PiecewiseLinearMap moved_;
  const double bound_;
  const StabilityOptions& options_;
  ProgramBudget budget_;
  const WordTree words_;
  long examined_ = 0;
};

bool WordsHold(const PiecewiseLinearMap& map, const StabilityCertificate& certificate,
               const StabilityOptions& options) {
  const Matrix& T = certificate.norm;
  if (!T.allFinite()) return false;
  if (!(T.colwise().norm().minCoeff() > 0)) return false;
  const Vector sizes = Eigen::JacobiSVD<Matrix>(T.colwise().normalized()).singularValues();
  if (!(sizes(0) <= kLargestCondition * sizes(sizes.size() - 1)) || !(sizes(0) > 0)) return false;
  if (certificate.words.empty() || !AreWordsOf(map, certificate.words)) return false;
  return WordCheck(map, certificate, options).Holds();
}

}  // namespace

const char* StabilityTestName(StabilityTest test) {
  constexpr const char* kNames[] = {"none",           "1-norm", "2-norm",      "∞-norm",
                                    "quadratic norm", "words",  "growing ray", "growing plane"};
  return kNames[static_cast<int>(test)];
}

bool MapsIntoItself(const PiecewiseLinearMap& map, const StabilityCertificate& certificate) {
  const Matrix& start = certificate.directions;
  const bool ray = certificate.test == StabilityTest::kGrowingRay;
  const Eigen::ColPivHouseholderQR<Matrix> independent(start);
  if (independent.rank() < start.cols()) return false;
  Matrix y = start;
  for (int i : certificate.words.front()) {
    AskBudget();
    const LinearPiece& piece = map.pieces()[i];
    const double size = y.norm();
    if (!(size > 0)) return false;
    if (piece.cone.rows() > 0) {
      const Matrix heights = piece.cone * y;
      if (!(heights.minCoeff() >= -kInCone * size)) return false;
      if (!ray && !(heights.maxCoeff() <= kInCone * size)) return false;
    }
    y = piece.matrix * y;
  }
  const Matrix action = independent.solve(y);
  if (!((y - start * action).norm() <= kInCone * (y.norm() + start.norm()))) return false;
  const double growth = ray ? action(0, 0) : action.eigenvalues().cwiseAbs().maxCoeff();
  return std::abs(growth - certificate.bound) <= kInCone * (1 + std::abs(growth));
}

StabilityCertificate CertificateInUnits(StabilityCertificate certificate, const Vector& sizes) {
  if (certificate.test == StabilityTest::kQuadraticNorm) {
    certificate.norm = FormInUnits(certificate.norm, sizes);
  }
  if (certificate.test == StabilityTest::kWords) {
    certificate.norm = RowsInUnits(certificate.norm, sizes);
  }
  const StabilityTest test = certificate.test;
  if (test == StabilityTest::kGrowingRay || test == StabilityTest::kGrowingPlane) {
    certificate.directions = (sizes.asDiagonal() * certificate.directions).eval();
    certificate.directions /= certificate.directions.norm();
  }
  return certificate;
}

bool VerifyCertificate(const PiecewiseLinearMap& map, const StabilityCertificate& given,
                       const StabilityOptions& options) {
  CheckOptions(options);
  if (map.pieces().empty() || map.rows() != map.cols()) return false;
  const double bound = given.bound;
  if (!std::isfinite(bound) || bound < 0) return false;
  for (const LinearPiece& piece : map.pieces()) {
    if (!piece.matrix.allFinite() || !piece.cone.allFinite()) return false;
  }
  // What is small beside a direction, or within a cone, is so in balanced units alone.
  const Vector sizes = BalancedSizes(map), inverse = sizes.cwiseInverse();
  if (!CheckConsistency(map, options.consistency).usable) return false;
  const bool contracts = bound<1 - options.margin, grows = bound> 1 + options.margin;
  const Matrix& directions = given.directions;
  switch (given.test) {
    case StabilityTest::kNone:
      return false;
    case StabilityTest::kNormOne:
    case StabilityTest::kNormTwo:
    case StabilityTest::kNormInfinity:
      return contracts && LargestNorm(map, given.test) <= bound + kRounding;
    case StabilityTest::kQuadraticNorm: {
      std::vector<Matrix> matrices;
      for (const LinearPiece& piece : map.pieces()) matrices.push_back(piece.matrix);
      return contracts && QuadraticRate(matrices, given.norm) <= bound + kRounding;
    }
    case StabilityTest::kWords:
      return contracts && given.norm.rows() == map.rows() && given.norm.cols() == map.rows() &&
             WordsHold(InSizes(map, sizes, sizes), CertificateInUnits(given, inverse), options);
    case StabilityTest::kGrowingRay:
    case StabilityTest::kGrowingPlane:
      return grows && given.words.size() == 1 && AreWordsOf(map, given.words) &&
             directions.rows() == map.rows() && directions.allFinite() &&
             directions.cwiseAbs().sum() > 0 && directions.cols() >= 1 &&
             directions.cols() <= (given.test == StabilityTest::kGrowingRay ? 1 : 2) &&
             MapsIntoItself(InSizes(map, sizes, sizes), CertificateInUnits(given, inverse));
  }
  return false;
}

}  // namespace contact_flow
