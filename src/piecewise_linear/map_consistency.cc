// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/map_consistency.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "cone_interior.h"
#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "half_spaces.h"

namespace contact_flow {
namespace {

/// A cone without interior is compared where a linear program says that it meets another; it may be
/// off by its own tolerance there.
constexpr double kThinFactor = 100;
constexpr long kPairsPerProgram = 100;  // looking at two lists of hyperplanes costs that little

/// A cone by its half-spaces, each once.
struct Cone {
  Matrix rows;              ///< unit normals
  std::vector<int> planes;  ///< the signed number of each, as Hyperplanes gives it
};

class ConsistencyCheck {
 public:
  ConsistencyCheck(const PiecewiseLinearMap& map, const MapConsistencyOptions& options)
      : map_(map),
        options_(options),
        tolerance_(options.tolerance),
        hyperplanes_(map.cols(), options.tolerance),
        scale_(Vector::Zero(map.rows())) {
    for (const LinearPiece& piece : map.pieces()) {
      if (!piece.matrix.allFinite() || !piece.cone.allFinite()) {
        throw std::invalid_argument("a matrix of the map is not finite");
      }
      scale_ = scale_.cwiseMax(piece.matrix.cwiseAbs().rowwise().sum());
      cones_.push_back(Read(piece.cone));
    }
  }

  MapConsistency Go() {
    const BudgetStage stage("the check that the pieces are one map");
    FindInteriors();
    if (going()) FindOverlaps();
    if (going()) FindOwners();
    for (std::size_t k = 0; k < full_.size() && going(); ++k) CheckFacets(full_[k]);
    if (going()) CheckThinCones();
    if (result_.ok() && (stopped_ || unsolved_)) {
      result_.defect = MapDefect::kUndecided;
      result_.message = !HaveLinearPrograms() ? "unchecked: built without linear programs (Clp)"
                        : cancelled_          ? "unchecked: the caller cancelled"
                        : stopped_ ? "unchecked: " + std::to_string(map_.pieces().size()) +
                                         " pieces need more than max_linear_programs = " +
                                         std::to_string(options_.max_linear_programs)
                                   : "unchecked: a linear program was not solved";
    }
    result_.usable =
        result_.ok() || (result_.defect == MapDefect::kUndecided && options_.believe_undecided);
    return result_;
  }

 private:
  bool going() const { return result_.ok() && !stopped_; }

  Cone Read(const Matrix& cone) {
    Cone read;
    read.rows.resize(cone.rows(), map_.cols());
    Eigen::Index kept = 0;
    for (Eigen::Index r = 0; r < cone.rows(); ++r) {
      const double length = cone.row(r).norm();
      if (!(length > 0)) continue;  // 0 ≥ 0
      const Vector normal = cone.row(r).transpose() / length;
      const int plane = hyperplanes_.SignedNumber(normal);
      if (std::find(read.planes.begin(), read.planes.end(), plane) != read.planes.end()) continue;
      read.planes.push_back(plane);
      read.rows.row(kept++) = normal.transpose();
    }
    read.rows.conservativeResize(kept, Eigen::NoChange);
    return read;
  }

  /// Counts a linear program; false when there is none left.
  bool Take() {
    if (stopped_) return false;
    cancelled_ = options_.cancelled && options_.cancelled();
    stopped_ = cancelled_ || result_.linear_programs >= options_.max_linear_programs ||
               !HaveLinearPrograms();
    if (!stopped_) ++result_.linear_programs;
    return !stopped_;
  }

  /// Does {z : rows·z ≥ 0} hold a ball that is not negligible? One or no half-space always does.
  bool HasBall(const Matrix& rows, double least, Vector* centre) {
    if (rows.rows() <= 1) {
      *centre = rows.rows() == 0 ? Vector(Vector::Zero(rows.cols())) : rows.row(0).transpose();
      return true;
    }
    if (!Take()) return false;
    const double radius = InteriorRadius(rows, centre);
    if (std::isnan(radius)) unsolved_ = true;
    return radius > least;
  }

  void FindInteriors() {
    Vector centre;
    for (std::size_t i = 0; i < cones_.size() && going(); ++i) {
      const bool thin = IsFlat(cones_[i]) || !HasBall(cones_[i].rows, kSmallestInterior, &centre);
      (thin ? thin_ : full_).push_back(static_cast<int>(i));
    }
    if (going() && full_.empty()) {
      result_.defect = MapDefect::kGap;
      result_.w = Vector::Unit(map_.cols(), 0);
      result_.size = 1;
      result_.message = "no piece's cone has interior";
    }
  }

  /// Between both sides of what counts as one hyperplane.
  bool IsFlat(const Cone& cone) const {
    return std::any_of(cone.planes.begin(), cone.planes.end(), [&](int plane) {
      return std::find(cone.planes.begin(), cone.planes.end(), -plane) != cone.planes.end();
    });
  }

  /// Is there a hyperplane, other than `except`, on whose opposite sides the two cones lie?
  bool Separated(const Cone& a, const Cone& b, int except = 0) const {
    for (int plane : a.planes) {
      if (std::abs(plane) == std::abs(except)) continue;
      if (std::find(b.planes.begin(), b.planes.end(), -plane) != b.planes.end()) return true;
    }
    return false;
  }

  void FindOverlaps() {
    overlapping_.resize(cones_.size());
    const long most = kPairsPerProgram * std::max(0L, options_.max_linear_programs);
    const long count = static_cast<long>(full_.size());
    if (count * (count - 1) / 2 > most) stopped_ = true;
    Vector centre;
    for (std::size_t a = 0; a < full_.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (!going()) return;
        const int i = full_[b], j = full_[a];
        if (Separated(cones_[i], cones_[j])) continue;
        const Matrix both = Stack(cones_[i].rows, cones_[j].rows);
        if (!HasBall(both, tolerance_, &centre)) continue;
        overlapping_[i].push_back(j);
        overlapping_[j].push_back(i);
        const Matrix whole = Matrix::Identity(map_.cols(), map_.cols());
        CompareOn(i, j, both, whole, MapDefect::kOverlap, tolerance_);
      }
    }
  }

  void FindOwners() {
    owners_.resize(2 * static_cast<std::size_t>(hyperplanes_.size()) + 1);
    for (int i : full_) {
      for (int plane : cones_[i].planes) Owners(plane)->push_back(i);
    }
  }

  std::vector<int>* Owners(int plane) {
    return &owners_[static_cast<std::size_t>(plane + hyperplanes_.size())];
  }

  /// Reports the largest |(A_i − A_j)_r w| over w = basis·z, rows·z ≥ 0, where it counts.
  void CompareOn(int i, int j, const Matrix& rows, const Matrix& basis, MapDefect kind,
                 double tolerance) {
    const Matrix difference = (map_.pieces()[i].matrix - map_.pieces()[j].matrix) * basis;
    for (Eigen::Index r = 0; r < difference.rows(); ++r) {
      const double least =
          std::max(tolerance, options_.rounding * scale_.maxCoeff() / scale_(r));  // of the row
      if (!(difference.row(r).cwiseAbs().sum() > least * scale_(r))) continue;
      const Vector bound = Vector::Ones(basis.cols());
      LinearProgram program(rows, -bound, bound);
      for (double sign : {1.0, -1.0}) {
        if (!Take()) return;
        const auto best = program.Maximize(sign / scale_(r) * difference.row(r).transpose());
        unsolved_ |= !best;
        if (!best) continue;
        const Vector w = basis * best->point;
        const double size = w.cwiseAbs().maxCoeff(), jump = best->value / size;
        if (!(best->value > least) || !(jump > std::max(least, result_.size))) continue;
        std::ostringstream message;
        message << "pieces " << i << " and " << j
                << (kind == MapDefect::kOverlap ? " overlap, and differ: "
                                                : " disagree where their cones meet: ")
                << "at w = (" << (w / size).transpose() << ") row " << r << " by "
                << best->value * scale_(r) / size << ", " << jump << " of the largest row";
        result_ = {kind, i, j, w / size, jump, result_.linear_programs, message.str()};
      }
    }
  }

  void CheckFacets(int i) {
    for (std::size_t r = 0; r < cones_[i].planes.size() && going(); ++r) {
      CheckFacet(i, cones_[i].planes[r], cones_[i].rows.row(static_cast<Eigen::Index>(r)));
    }
  }

  /// Those of cone k in the hyperplane.
  Matrix Inside(int k, int plane, const Matrix& basis) const {
    const Cone& cone = cones_[k];
    Matrix others(cone.rows.rows(), cone.rows.cols());
    Eigen::Index count = 0;
    for (Eigen::Index r = 0; r < cone.rows.rows(); ++r) {
      if (std::abs(cone.planes[static_cast<std::size_t>(r)]) != std::abs(plane)) {
        others.row(count++) = cone.rows.row(r);
      }
    }
    return Restrict(others.topRows(count), basis, tolerance_);
  }

  /// Facet of cone i with this inward normal: is there another piece behind all of it, and do they
  /// agree on it?
  void CheckFacet(int i, int plane, const Matrix& normal) {
    const Matrix basis = BasisOf(normal);
    const Matrix facet = Inside(i, plane, basis);
    Vector centre;
    if (!HasBall(facet, tolerance_, &centre)) return;  // the half-space is redundant
    std::vector<int> candidates = *Owners(-plane);
    for (int j : overlapping_[i]) {
      const std::vector<int>& planes = cones_[j].planes;
      const bool beside = std::find(planes.begin(), planes.end(), plane) != planes.end() ||
                          std::find(planes.begin(), planes.end(), -plane) != planes.end();
      if (!beside) candidates.push_back(j);
    }
    std::vector<Behind> behind;
    for (int j : candidates) {
      if (Separated(cones_[i], cones_[j], plane)) continue;
      Behind other{j, Inside(j, plane, basis)};
      const Matrix common = Restrict(Stack(facet, other.rows),
                                     Matrix::Identity(basis.cols(), basis.cols()), tolerance_);
      if (!HasBall(common, tolerance_, &centre)) {
        if (!going()) return;
        continue;
      }
      if (i < j) CompareOn(i, j, common, basis, MapDefect::kJump, tolerance_);
      if (!going()) return;
      behind.push_back(std::move(other));
    }
    CheckCovered(i, normal, basis, facet, behind);
  }

  /// A cone behind a facet, restricted to the hyperplane.
  struct Behind {
    int piece;
    Matrix rows;
  };

  /// Is `region` within the union of those behind? What one leaves over is left to the others.
  void CheckCovered(int i, const Matrix& normal, const Matrix& basis, const Matrix& region,
                    const std::vector<Behind>& behind) {
    Vector centre;
    if (!HasBall(region, tolerance_, &centre) || !going()) return;
    auto best = behind.end();
    double height = -tolerance_;
    for (auto it = behind.begin(); it != behind.end(); ++it) {
      const double smallest = SmallestHeight(it->rows, centre);
      if (smallest < height) continue;
      height = smallest;
      best = it;
    }
    if (best == behind.end()) {
      ReportGap(i, basis * centre, normal.row(0).transpose());
      return;
    }
    std::vector<Behind> others = behind;
    others.erase(others.begin() + (best - behind.begin()));
    Matrix within = region;
    for (Eigen::Index r = 0; r < best->rows.rows() && going(); ++r) {
      const Matrix row = best->rows.row(r);
      bool implied = false;
      for (Eigen::Index k = 0; k < within.rows() && !implied; ++k) {
        implied = (within.row(k) - row).cwiseAbs().maxCoeff() <= tolerance_;
      }
      if (implied) continue;
      CheckCovered(i, normal, basis, Stack(within, -row), others);
      within = Stack(within, row);
    }
  }

  /// Nothing known is behind piece i at w: reports the direction beside it that is farthest from
  /// all cones, unless they are all within the tolerance.
  void ReportGap(int i, const Vector& w, const Vector& normal) {
    const double size = w.norm();
    const Vector at = size > 0 ? Vector(w / size) : w;
    for (double away = 1; away > 0.1 * tolerance_; away /= 2) {
      Vector beside = at - away * normal;
      beside /= beside.cwiseAbs().maxCoeff();
      double nearest = -std::numeric_limits<double>::infinity();
      for (const Cone& cone : cones_)
        nearest = std::max(nearest, SmallestHeight(cone.rows, beside));
      if (-nearest <= std::max(0.25 * tolerance_, result_.size)) continue;
      std::ostringstream message;
      message << "no piece's cone holds the direction (" << beside.transpose()
              << "), behind a face of piece " << i << ", " << -nearest << " away from the nearest";
      result_ = {MapDefect::kGap, i, -1, beside, -nearest, result_.linear_programs, message.str()};
    }
  }

  /// On cones without interior the values must be those of the map.
  void CheckThinCones() {
    const Matrix whole = Matrix::Identity(map_.cols(), map_.cols());
    for (int i : thin_) {
      for (int j : full_) {
        if (!going()) return;
        CompareOn(i, j, Stack(cones_[i].rows, cones_[j].rows), whole, MapDefect::kJump,
                  kThinFactor * tolerance_);
      }
    }
  }

  const PiecewiseLinearMap& map_;
  const MapConsistencyOptions& options_;
  const double tolerance_;
  Hyperplanes hyperplanes_;
  Vector scale_;  ///< max_k ‖(A_k)_r‖₁
  std::vector<Cone> cones_;
  std::vector<int> full_, thin_;               ///< pieces with interior, and without
  std::vector<std::vector<int>> overlapping_;  ///< with each piece, where their matrices agree
  std::vector<std::vector<int>> owners_;       ///< of each half-space, by its signed number
  bool stopped_ = false, cancelled_ = false, unsolved_ = false;
  MapConsistency result_;
};

}  // namespace

const char* MapDefectName(MapDefect defect) {
  constexpr const char* kNames[] = {"none", "gap", "overlap", "jump", "undecided"};
  return kNames[static_cast<int>(defect)];
}

MapConsistency CheckConsistency(const PiecewiseLinearMap& map,
                                const MapConsistencyOptions& options) {
  if (map.pieces().empty()) throw std::invalid_argument("a piecewise-linear map needs a piece");
  return options.checked ? MapConsistency() : ConsistencyCheck(map, options).Go();
}

}  // namespace contact_flow
