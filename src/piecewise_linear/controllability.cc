// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/controllability.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cone_interior.h"
#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/section.h"

namespace contact_flow {
namespace {

constexpr double kClear = 1e-7;  // a unit preimage this near to a face is not counted on
constexpr int kGenericTries = 100;
constexpr int kDegreeChecks = 3;  // generic y whose degrees must agree
constexpr Eigen::Index kManyColumns = 2048;
/// Share of y that a linear program must attain by w up to this size, in balanced units.
constexpr double kAttained = 1e-6, kFarthest = 1e4;

Vector RandomUnit(Eigen::Index n, std::mt19937* generator) {
  std::normal_distribution<double> normal;
  Vector y(n);
  for (Eigen::Index i = 0; i < n; ++i) y(i) = normal(*generator);
  return y.normalized();
}

/// The images of all pieces side by side, or, where these are many columns, a matrix [r×r] with the
/// same singular values and left singular vectors: L of [images] = L Qᵀ, factored block by block.
Matrix Images(const PiecewiseLinearMap& map) {
  const Eigen::Index r = map.rows(), m = map.cols();
  const auto count = static_cast<Eigen::Index>(map.pieces().size());
  if (m * count <= std::max(kManyColumns, r)) {
    Matrix images(r, m * count);
    for (Eigen::Index i = 0; i < count; ++i) {
      images.middleCols(m * i, m) = map.pieces()[static_cast<std::size_t>(i)].matrix;
    }
    return images;
  }
  Matrix upper = Matrix::Zero(r, r);  // Lᵀ so far
  for (const LinearPiece& piece : map.pieces()) {
    AskBudget();
    Matrix stacked(r + m, r);
    stacked << upper, piece.matrix.transpose();
    const Eigen::HouseholderQR<Matrix> factor(stacked);
    upper = factor.matrixQR().topRows(r).triangularView<Eigen::Upper>();
  }
  return upper.transpose();
}

/// Units of rows and columns in which the largest entries of all pieces are 1, where not all are 0.
void Balance(const PiecewiseLinearMap& map, Vector* rows, Vector* columns) {
  Matrix largest = Matrix::Zero(map.rows(), map.cols());
  for (const LinearPiece& piece : map.pieces()) {
    largest = largest.cwiseMax(piece.matrix.cwiseAbs());
  }
  const auto units = [](const Vector& sizes) {
    return Vector((sizes.array() > 0).select(sizes, 1.0));
  };
  *rows = units(largest.rowwise().maxCoeff());
  const Matrix scaled = rows->cwiseInverse().asDiagonal() * largest;
  *columns = units(scaled.colwise().maxCoeff().transpose()).cwiseInverse();
}

/// Is y = f(w) for some w? Per piece, max t subject to A w = t y, w ∈ C, |w_k| ≤ kFarthest, t ≤ 1.
/// True when the programs do not tell.
bool IsAttained(const PiecewiseLinearMap& map, const Vector& y) {
  if (!HaveLinearPrograms()) return true;
  const int m = map.cols(), r = map.rows();
  for (const LinearPiece& piece : map.pieces()) {
    AskBudget();
    const int h = static_cast<int>(piece.cone.rows());
    Matrix rows(h + 2 * r, m + 1);
    rows << piece.cone, Matrix::Zero(h, 1), piece.matrix, -y, -piece.matrix, y;
    Vector upper = Vector::Constant(m + 1, kFarthest);
    upper(m) = 1;
    Vector lower = -upper;
    lower(m) = 0;
    const std::optional<LinearOptimum> best =
        LinearProgram(rows, lower, upper).Maximize(Vector::Unit(m + 1, m));
    if (!best || best->value > kAttained) return true;
  }
  return false;
}

/// Looks for a y that f does not attain: opposite to the middle of each piece's image, then at
/// random, in units of which none decides.
void SeekUnattained(const PiecewiseLinearMap& map, const ControllabilityOptions& options,
                    std::mt19937* generator, ControllabilityReport* report) {
  Vector rows, columns;
  const PiecewiseLinearMap reached =
      InBases(map, report->reachable, Matrix::Identity(map.cols(), map.cols()));
  Balance(reached, &rows, &columns);
  const PiecewiseLinearMap onto =
      InBases(reached, Matrix(rows.cwiseInverse().asDiagonal()), Matrix(columns.asDiagonal()));
  std::vector<Vector> candidates;
  for (const LinearPiece& piece : onto.pieces()) {
    AskBudget();
    Vector middle;
    InteriorRadius(piece.cone, &middle);
    const Vector image = piece.matrix * middle;
    if (image.norm() > 0) candidates.push_back(-image.normalized());
  }
  const std::size_t limit = static_cast<std::size_t>(std::max(0, options.max_candidates));
  while (candidates.size() < limit) candidates.push_back(RandomUnit(onto.rows(), generator));
  candidates.resize(std::min(candidates.size(), limit));
  BudgetStage stage("the search for a state that is not reached", candidates.size());
  for (const Vector& y : candidates) {
    AskBudget();
    stage.Next();
    if (options.cancelled && options.cancelled()) return;
    if (IsAttained(onto, y)) continue;
    report->verdict = ControllabilityVerdict::kNotControllable;
    report->unattained = (report->reachable * rows.cwiseProduct(y)).normalized();
    return;
  }
}

/// Orientation, degree and preimages of a square map; false when its degree is not to be had.
bool ExamineSquare(const PiecewiseLinearMap& square, double rank_tolerance, std::mt19937* generator,
                   ControllabilityReport* report) {
  bool positive = false, negative = false;
  report->pieces = static_cast<int>(square.pieces().size());
  report->smallest_singular_ratio = 1;
  for (const LinearPiece& piece : square.pieces()) {
    AskBudget();
    const Vector values = Eigen::JacobiSVD<Matrix>(piece.matrix).singularValues();
    const double ratio = values(0) > 0 ? values(values.size() - 1) / values(0) : 0;
    report->smallest_singular_ratio = std::min(report->smallest_singular_ratio, ratio);
    (Eigen::PartialPivLU<Matrix>(piece.matrix).determinant() > 0 ? positive : negative) = true;
  }
  const bool regular = report->smallest_singular_ratio > rank_tolerance;
  report->coherently_oriented = regular && positive != negative;
  report->degree = report->preimages = 0;
  report->homeomorphism = false;
  report->twins.clear();
  if (!regular) return false;
  int found = 0;
  for (int trial = 0; trial < kGenericTries && found < kDegreeChecks; ++trial) {
    AskBudget();
    bool clear = false;
    const std::vector<Vector> preimages =
        Preimages(square, RandomUnit(square.rows(), generator), &clear);
    if (!clear) continue;
    int degree = 0;
    for (const Vector& z : preimages) {
      const Matrix& A = square.pieces()[square.PieceAt(z)].matrix;
      degree += Eigen::PartialPivLU<Matrix>(A).determinant() > 0 ? 1 : -1;
    }
    if (report->twins.empty() && preimages.size() > 1) {
      report->twins = {preimages[0], preimages[1]};
    }
    if (found > 0 && degree != report->degree) return false;  // not continuous
    report->degree = degree;
    report->preimages = static_cast<int>(preimages.size());
    ++found;
  }
  report->homeomorphism = found > 0 && report->coherently_oriented && report->preimages == 1;
  return found > 0;
}

/// Subspaces of inputs to try: what each piece needs, what they need on average, coordinates,
/// random ones.
std::vector<Matrix> Restrictions(const PiecewiseLinearMap& map, const Matrix& reachable, int limit,
                                 std::mt19937* generator) {
  const Eigen::Index m = map.cols(), k = reachable.cols();
  if (m == k) return {Matrix::Identity(m, m)};
  std::vector<Matrix> matrices = {Matrix::Zero(k, m)};
  for (const LinearPiece& piece : map.pieces()) {
    const Matrix A = reachable.transpose() * piece.matrix;
    matrices.front() += A / static_cast<double>(map.pieces().size());
    matrices.push_back(A);
  }
  std::vector<Matrix> subspaces;
  for (const Matrix& A : matrices) {
    AskBudget();
    const Eigen::JacobiSVD<Matrix> parts(A, Eigen::ComputeFullV);
    subspaces.push_back(parts.matrixV().leftCols(k));
  }
  const Eigen::ColPivHouseholderQR<Matrix> pivots(matrices.front());
  Matrix coordinates = Matrix::Zero(m, k);
  for (Eigen::Index c = 0; c < k; ++c) coordinates(pivots.colsPermutation().indices()(c), c) = 1;
  subspaces.insert(subspaces.begin() + 1, coordinates);
  while (static_cast<int>(subspaces.size()) < limit) {
    AskBudget();
    Matrix random(m, k);
    for (Eigen::Index c = 0; c < k; ++c) random.col(c) = RandomUnit(m, generator);
    subspaces.push_back(Eigen::HouseholderQR<Matrix>(random).householderQ() *
                        Matrix::Identity(m, k));
  }
  subspaces.resize(std::max(1, limit));
  return subspaces;
}

std::string Describe(const ControllabilityReport& report) {
  std::ostringstream message;
  message << (report.verdict == ControllabilityVerdict::kControllable      ? "controllable"
              : report.verdict == ControllabilityVerdict::kNotControllable ? "not controllable"
                                                                           : "undetermined");
  const Eigen::Index all = report.reachable.rows(), reached = report.reachable.cols();
  if (reached < all) {
    message << " in the " << reached << " of " << all << " dimensions that inputs reach";
  }
  message << ": " << report.pieces << " pieces, "
          << (report.coherently_oriented ? "coherently oriented" : "not coherently oriented")
          << ", degree " << report.degree << ", "
          << (report.homeomorphism ? "a homeomorphism" : "no homeomorphism");
  if (report.unattained.size() > 0) {
    message << "; (" << report.unattained.transpose() << ") is not attained";
  }
  if (!HaveLinearPrograms()) message << "; built without linear programs (Clp)";
  return message.str();
}

}  // namespace

Matrix ReachableBasis(const PiecewiseLinearMap& map, double rank_tolerance) {
  const int r = map.rows();
  Matrix images = Images(map);
  if (!images.allFinite()) throw std::invalid_argument("a matrix of the map is not finite");
  Eigen::JacobiSVD<Matrix> parts(images, Eigen::ComputeThinU);
  parts.setThreshold(rank_tolerance);
  if (parts.rank() == r) return Matrix::Identity(r, r);  // orientation is kept
  return parts.matrixU().leftCols(parts.rank());
}

std::vector<Vector> Preimages(const PiecewiseLinearMap& map, const VectorRef& y, bool* clear) {
  if (map.rows() != map.cols() || y.size() != map.rows()) {
    throw std::invalid_argument("preimages are counted for square maps");
  }
  std::vector<Vector> preimages;
  *clear = true;
  for (const LinearPiece& piece : map.pieces()) {
    AskBudget();
    const Eigen::FullPivLU<Matrix> factor(piece.matrix);
    if (!factor.isInvertible()) {
      *clear = false;
      continue;
    }
    const Vector z = factor.solve(y).normalized();
    const double margin = piece.Margin(z);
    if (std::abs(margin) < kClear) *clear = false;
    if (margin >= 0) preimages.push_back(z * (y.norm() / (piece.matrix * z).norm()));
  }
  return preimages;
}

ControllabilityReport AssessControllability(const PiecewiseLinearMap& map,
                                            const ControllabilityOptions& options) {
  RequireEntries(map);
  const BudgetStage whole("the controllability of a map");
  ControllabilityReport report;
  std::mt19937 generator(1);
  report.reachable = ReachableBasis(map, options.rank_tolerance);
  MapConsistencyOptions consistency = options.consistency;
  if (!consistency.cancelled) consistency.cancelled = options.cancelled;
  report.consistency = CheckConsistency(map, consistency);
  if (!report.consistency.usable) {
    report.message = "undetermined: " + report.consistency.message;
    if (report.consistency.defect != MapDefect::kUndecided) {
      report.message += ", so that this is not a map";
    }
    return report;
  }
  const Eigen::Index k = report.reachable.cols();
  if (k == 0) {
    report.message = "undetermined: no input has any effect, the reachable space is a point";
    return report;
  }
  if (map.cols() >= k) {
    BudgetStage stage("the restrictions of the inputs");
    ControllabilityReport best;
    bool any = false;
    for (const Matrix& inputs :
         Restrictions(map, report.reachable, options.max_restrictions, &generator)) {
      if (options.cancelled && options.cancelled()) break;
      AskBudget();
      stage.Next();
      ControllabilityReport trial = report;
      trial.restriction = inputs;
      const PiecewiseLinearMap square = InBases(map, report.reachable, inputs);
      const bool known = ExamineSquare(square, options.rank_tolerance, &generator, &trial);
      if (trial.coherently_oriented || (known && trial.degree != 0)) {
        trial.verdict = ControllabilityVerdict::kControllable;
      }
      for (Vector& twin : trial.twins) twin = (inputs * twin).eval();
      const auto merit = [](const ControllabilityReport& r) {
        return 4 * (r.verdict == ControllabilityVerdict::kControllable) + 2 * r.homeomorphism +
               r.coherently_oriented;
      };
      if (!any || merit(trial) > merit(best)) best = trial;
      any = true;
      if (best.homeomorphism) break;
    }
    if (any) report = best;
  }
  if (report.verdict != ControllabilityVerdict::kControllable) {
    SeekUnattained(map, options, &generator, &report);
  }
  report.message = Describe(report);
  return report;
}

}  // namespace contact_flow
