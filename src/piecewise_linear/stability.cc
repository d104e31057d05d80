// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/stability.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "balance.h"
#include "common_quadratic_norm.h"
#include "cone_interior.h"
#include "contact_flow/budget.h"
#include "stability_certificate.h"
#include "word.h"

namespace contact_flow {
namespace {

constexpr double kGoodEnough = 0.99;  // a quadratic rate that needs no further improvement

std::vector<Matrix> MatricesOf(const PiecewiseLinearMap& map) {
  std::vector<Matrix> matrices;
  for (const LinearPiece& piece : map.pieces()) matrices.push_back(piece.matrix);
  return matrices;
}

void RequireSelfMap(const PiecewiseLinearMap& map) {
  if (map.pieces().empty() || map.rows() != map.cols() || map.rows() == 0) {
    throw std::invalid_argument("stability is a property of a map of a space into itself");
  }
}

/// T with ‖T y‖₂ = √(yᵀPy), symmetric.
Matrix Root(const Matrix& P) { return Eigen::SelfAdjointEigenSolver<Matrix>(P).operatorSqrt(); }

/// Steps 2 and 3: words by growing length, in coordinates T y.
class WordSearch {
 public:
  WordSearch(const PiecewiseLinearMap& map, const Matrix& T, const StabilityOptions& options,
             StabilityReport* report)
      : map_(map),
        moved_(ChangeCoordinates(map, T)),
        T_(T),
        inverse_(T.inverse()),
        options_(options),
        report_(report) {
    budget_.left = options.max_linear_programs;
  }

  void Go() {
    std::vector<Word> frontier = {EmptyWord(map_.cols())};
    std::string stopped;
    while (!frontier.empty() && stopped.empty()) {
      if (report_->word_length >= options_.max_word_length) {
        stopped = "words of max_word_length = " + std::to_string(options_.max_word_length);
        break;
      }
      std::vector<Word> longer;
      if (!Extend(frontier, &longer, &stopped)) break;
      frontier = std::move(longer);
      ++report_->word_length;
      // Every y contracts at the end of a word done with, or has grown no more than a
      // word that is left.
      double rate = done_rate_;
      for (const Word& word : frontier) {
        rate = std::max(rate, std::pow(word.matrix.cwiseAbs().rowwise().sum().maxCoeff(),
                                       1.0 / report_->word_length));
      }
      report_->growth_above = std::min(report_->growth_above, rate);
    }
    report_->linear_programs = budget_.used;
    if (report_->verdict == StabilityVerdict::kUnstable) return;
    std::ostringstream message;
    if (frontier.empty()) {
      report_->verdict = StabilityVerdict::kStable;
      report_->certificate = {StabilityTest::kWords, done_gain_, T_, done_, Matrix()};
      message << "stable: every word of at most " << report_->word_length
              << " pieces contracts, by " << done_gain_ << " at the least";
    } else {
      message << "undetermined: " << stopped << " did not decide; growth per step is between "
              << report_->growth_below << " and " << report_->growth_above;
      if (!HaveLinearPrograms()) message << "; built without linear programs (Clp)";
    }
    report_->message = message.str();
  }

 private:
  /// Appends every piece to every word of `frontier`; false when the search is over.
  bool Extend(const std::vector<Word>& frontier, std::vector<Word>* longer, std::string* stopped) {
    const double threshold = 1 - options_.margin;
    double bytes = 0;
    for (const Word& word : frontier) {
      bytes += 8.0 * static_cast<double>(word.matrix.size() + word.cone.size());
    }
    for (const Word& word : frontier) {
      for (std::size_t i = 0; i < moved_.pieces().size(); ++i) {
        if (report_->words >= options_.max_words) {
          *stopped = "max_words = " + std::to_string(options_.max_words) + " words";
        } else if (budget_.left < 2 * map_.cols() + 1) {
          *stopped = "max_linear_programs = " + std::to_string(options_.max_linear_programs);
        } else if (options_.cancelled && options_.cancelled()) {
          *stopped = "the caller cancelled and the words so far";
        }
        if (!stopped->empty()) return false;
        AskBudget();
        stage_.Next();
        Word next = Append(moved_, word, static_cast<int>(i));
        ++report_->words;
        budget_.Take(1);
        Vector inside;
        if (InteriorRadius(next.cone, &inside) <= kSmallestInterior) continue;
        const double norm = next.matrix.cwiseAbs().rowwise().sum().maxCoeff();
        const double size = inside.cwiseAbs().maxCoeff();
        const bool known = (next.matrix * inside).cwiseAbs().maxCoeff() >= threshold * size;
        const double gain = size > 0 && known ? norm : GainBound(next, threshold, false, &budget_);
        if (gain < threshold) {
          done_gain_ = std::max(done_gain_, gain);
          done_rate_ =
              std::max(done_rate_, std::pow(gain, 1 / static_cast<double>(next.pieces.size())));
          done_.push_back(next.pieces);
          continue;
        }
        if (Grows(next)) return false;
        bytes += 8.0 * static_cast<double>(next.matrix.size() + next.cone.size());
        if (longer->size() % 16 == 0) {
          AskMemory(bytes, std::to_string(frontier.size() + longer->size() + 1) + " words");
        }
        longer->push_back(std::move(next));
      }
    }
    return true;
  }

  /// Looks for a ray or plane that the word maps into itself, and reports when it grows.
  bool Grows(const Word& word) {
    const Eigen::EigenSolver<Matrix> spectrum(word.matrix);
    if (spectrum.info() != Eigen::Success) return false;
    const double steps = static_cast<double>(word.pieces.size());
    for (Eigen::Index k = 0; k < word.matrix.rows(); ++k) {
      const std::complex<double> value = spectrum.eigenvalues()(k);
      const double size = std::abs(value);
      if (size <= std::pow(report_->growth_below, steps)) continue;
      const bool real = value.imag() == 0;
      const Eigen::VectorXcd vector = spectrum.eigenvectors().col(k);
      StabilityCertificate certificate;
      certificate.bound = size;
      certificate.words = {word.pieces};
      certificate.directions.resize(word.matrix.rows(), real ? 1 : 2);
      certificate.directions.col(0) = inverse_ * vector.real();
      if (!real) certificate.directions.col(1) = inverse_ * vector.imag();
      certificate.directions /= certificate.directions.norm();
      for (double sign : {1.0, -1.0}) {
        certificate.test =
            real && value.real() > 0 ? StabilityTest::kGrowingRay : StabilityTest::kGrowingPlane;
        certificate.directions *= sign;
        if (!MapsIntoItself(map_, certificate)) continue;
        report_->growth_below = std::pow(size, 1 / steps);
        if (size < 1 + options_.margin) break;
        Report(certificate);
        return true;
      }
    }
    return false;
  }

  void Report(const StabilityCertificate& certificate) {
    report_->verdict = StabilityVerdict::kUnstable;
    report_->certificate = certificate;
    std::ostringstream message;
    message << "unstable: a direction grows by " << certificate.bound << " in "
            << certificate.words[0].size() << " steps";
    report_->message = message.str();
  }

  const PiecewiseLinearMap& map_;
  const PiecewiseLinearMap moved_;
  const Matrix T_, inverse_;
  const StabilityOptions& options_;
  StabilityReport* report_;
  ProgramBudget budget_;
  BudgetStage stage_{"the words of pieces"};
  std::vector<std::vector<int>> done_;
  double done_gain_ = 0, done_rate_ = 0;
};

}  // namespace

void CheckOptions(const StabilityOptions& options) {
  const auto check = [](const char* name, bool is_right, double value, const char* expected) {
    if (is_right) return;
    std::ostringstream message;
    message << name << " is " << value << ", expected " << expected;
    throw std::invalid_argument(message.str());
  };
  check("margin", options.margin >= 0 && options.margin < 1, options.margin, "a number in [0, 1)");
  check("max_word_length", options.max_word_length >= 1, options.max_word_length, "≥ 1");
  check("max_words", options.max_words >= 1, static_cast<double>(options.max_words), "≥ 1");
  check("max_linear_programs", options.max_linear_programs >= 0,
        static_cast<double>(options.max_linear_programs), "≥ 0");
}

StabilityReport AssessStability(const PiecewiseLinearMap& map, const StabilityOptions& options) {
  RequireSelfMap(map);
  CheckOptions(options);
  const BudgetStage stage("the stability of a map");
  StabilityReport report;
  for (const Matrix& A : MatricesOf(map)) {
    AskBudget();
    if (!A.allFinite()) throw std::invalid_argument("a matrix of the map is not finite");
    report.norm_one = std::max(report.norm_one, A.cwiseAbs().colwise().sum().maxCoeff());
    report.norm_two = std::max(report.norm_two, Eigen::JacobiSVD<Matrix>(A).singularValues()(0));
    report.norm_infinity = std::max(report.norm_infinity, A.cwiseAbs().rowwise().sum().maxCoeff());
  }
  report.norm_quadratic = report.norm_two;
  report.growth_above = std::min({report.norm_one, report.norm_two, report.norm_infinity});
  const auto contracts = [&](StabilityTest test, double bound, const Matrix& norm) {
    if (!(bound < 1 - options.margin)) return false;
    report.verdict = StabilityVerdict::kStable;
    report.certificate = {test, bound, norm, {}, Matrix()};
    std::ostringstream message;
    message << "stable: every piece contracts in the " << StabilityTestName(test) << ", by "
            << bound;
    report.message = message.str();
    return true;
  };
  MapConsistencyOptions consistency = options.consistency;
  if (!consistency.cancelled) consistency.cancelled = options.cancelled;
  const Vector sizes = BalancedSizes(map);
  report.consistency = CheckConsistency(map, consistency);
  if (!report.consistency.usable) {
    report.message = "undetermined: " + report.consistency.message;
    if (report.consistency.defect != MapDefect::kUndecided) {
      report.message += ", so that this is not a map";
    }
    report.growth_above = std::numeric_limits<double>::infinity();
    return report;
  }
  if (contracts(StabilityTest::kNormOne, report.norm_one, Matrix()) ||
      contracts(StabilityTest::kNormTwo, report.norm_two, Matrix()) ||
      contracts(StabilityTest::kNormInfinity, report.norm_infinity, Matrix())) {
    return report;
  }
  // From here on in units in which neither numbers nor cones differ for those of the caller.
  const PiecewiseLinearMap balanced = InSizes(map, sizes, sizes);
  const CommonQuadraticNorm quadratic =
      FindCommonQuadraticNorm(MatricesOf(balanced), kGoodEnough, options.cancelled);
  report.norm_quadratic = std::min(report.norm_two, quadratic.rate);
  report.growth_above = std::min(report.growth_above, report.norm_quadratic);
  if (contracts(StabilityTest::kQuadraticNorm, quadratic.rate, quadratic.P)) {
    report.certificate = CertificateInUnits(report.certificate, sizes);
    return report;
  }
  WordSearch(balanced, Root(quadratic.P), options, &report).Go();
  report.certificate = CertificateInUnits(report.certificate, sizes);
  return report;
}

double WorstGain(const PiecewiseLinearMap& map, int steps, const StabilityOptions& options) {
  RequireSelfMap(map);
  CheckOptions(options);
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  if (steps < 1) throw std::invalid_argument("WorstGain needs at least one step");
  if (!HaveLinearPrograms()) return unknown;
  ProgramBudget budget{options.max_linear_programs, 0};
  std::vector<Word> words = {EmptyWord(map.cols())};
  long examined = 0;
  for (int k = 0; k < steps; ++k) {
    std::vector<Word> longer;
    for (const Word& word : words) {
      for (std::size_t i = 0; i < map.pieces().size(); ++i) {
        if (++examined > options.max_words || !budget.Take(1)) return unknown;
        if (options.cancelled && options.cancelled()) return unknown;
        AskBudget();
        Word next = Append(map, word, static_cast<int>(i));
        if (HasInterior(next.cone)) longer.push_back(std::move(next));
      }
    }
    words = std::move(longer);
  }
  double gain = 0;
  for (const Word& word : words) {
    if (budget.left < 2 * map.cols()) return unknown;
    gain = std::max(gain, GainBound(word, 0, true, &budget));
  }
  return gain;
}

}  // namespace contact_flow
