// SPDX-License-Identifier: BSD-3-Clause
#include "path_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/event_map.h"
#include "src/piecewise_linear/cone_interior.h"
#include "src/piecewise_linear/half_spaces.h"

namespace contact_flow {
namespace {

/// A direction lies on a facet, relative; two facets are one.
constexpr double kFacet = 1e-9;
/// What no larger ball fits into is left over by rounding.
constexpr double kThinnest = 1e-7;
/// Matrices in sizes that differ by less, relative, are one; and what they make of a direction.
constexpr double kOneMatrix = 1e-8, kOneValue = 1e-6;
/// So many directions around the middle of a gap are followed, and anywhere, for a check.
constexpr int kAttempts = 8, kChecks = 100;
/// Without linear programs: rays for each facet from inside a cone, which go on by this much
/// beyond it, relative, and directions anywhere.
constexpr int kRays = 6, kBlindDirections = 200;
constexpr double kBeyond = 1e-3;

/// How far it is from z, inside the cone, to its first facet along a ray, or `most`.
double Reach(const Matrix& cone, const Vector& z, const Vector& along, double most) {
  const Vector slope = cone * along, height = cone * z;
  for (Eigen::Index row = 0; row < cone.rows(); ++row) {
    if (slope(row) < 0) most = std::min(most, std::max(height(row), 0.0) / -slope(row));
  }
  return most;
}

/// The half-space `row`, among `rows`, or −1.
Eigen::Index Find(const Matrix& rows, const Eigen::RowVectorXd& row) {
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    if ((rows.row(r) - row).cwiseAbs().maxCoeff() <= kFacet) return r;
  }
  return -1;
}

Matrix WithoutRow(const Matrix& rows, Eigen::Index row) {
  Matrix others(rows.rows() - 1, rows.cols());
  others << rows.topRows(row), rows.bottomRows(rows.rows() - 1 - row);
  return others;
}

/// The radius of a part of the directions, with its middle.
double Radius(const Matrix& region, Vector* centre) {
  const double radius = InteriorRadius(region, centre);
  if (!std::isnan(radius)) return radius;
  throw NotPiecewiseLinear(
      "whether the pieces of a cluster with friction are all is not known: a linear program was "
      "not solved");
}

bool IsThin(const Matrix& region, double least) {
  Vector centre;
  return !(Radius(region, &centre) > least);
}

/// Each facet once.
Matrix Facets(Matrix rows) {
  for (Eigen::Index r = rows.rows() - 1; r >= 0; --r) {
    const Matrix others = WithoutRow(rows, r);
    if (IsThin(Stack(others, -rows.row(r)), kSmallestInterior)) rows = others;
  }
  return rows;
}

}  // namespace

PathSearch::PathSearch(Follow follow, Vector sizes, Matrix basis, std::size_t max_pieces)
    : follow_(std::move(follow)),
      sizes_(std::move(sizes)),
      basis_(std::move(basis)),
      max_pieces_(max_pieces) {}

Vector PathSearch::Draw() {
  std::normal_distribution<double> normal;
  Vector z(basis_.cols());
  for (double& entry : z) entry = normal(random_);
  return z;
}

/// What is followed along z.
PathSearch::Piece PathSearch::PieceOf(const Vector& z) const {
  const Vector w = sizes_.cwiseProduct(basis_ * z);
  Piece piece{follow_(w), {}, {}, z};
  const Matrix cone = piece.path.cone * sizes_.asDiagonal() * basis_;
  piece.rows.resize(cone.rows(), cone.cols());
  Eigen::Index count = 0;
  for (Eigen::Index r = 0; r < cone.rows(); ++r) {
    const Eigen::RowVectorXd row = cone.row(r).normalized();
    if (Find(piece.rows.topRows(count), row) < 0) piece.rows.row(count++) = row;
  }
  piece.rows.conservativeResize(count, Eigen::NoChange);
  piece.matrix = sizes_.cwiseInverse().asDiagonal() * piece.path.matrix * sizes_.asDiagonal();
  return piece;
}

/// Whether the direction lies inside its own cone.
bool PathSearch::Decided(const Piece& piece) {
  return SmallestHeight(piece.rows, piece.inside) > kFacet * piece.inside.norm();
}

/// The piece whose cone holds z best, −1: none.
int PathSearch::Holding(const Vector& z) const {
  int best = -1;
  double most = -kFacet * z.norm();
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const double height = SmallestHeight(pieces_[k].rows, z);
    if (height < most) continue;
    best = static_cast<int>(k);
    most = height;
  }
  return best;
}

int PathSearch::Add(Piece piece) {
  if (pieces_.size() >= max_pieces_) {
    throw std::length_error("a cluster with friction has more than " + std::to_string(max_pieces_) +
                            " pieces");
  }
  pieces_.push_back(std::move(piece));
  return static_cast<int>(pieces_.size()) - 1;
}

/// Follows what lies in a ball that no cone holds.
int PathSearch::Explore(const Vector& centre, double radius) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    Piece piece = PieceOf(centre + 0.5 * radius * Draw().normalized());
    if (!Decided(piece)) continue;
    piece.rows = Facets(piece.rows);
    return Add(std::move(piece));
  }
  throw NotPiecewiseLinear(
      "the pieces of a cluster with friction are not known for all directions: around some none is "
      "found");
}

/// What the cone of the middle leaves of the region is left to others.
void PathSearch::Cover(Matrix region) {
  AskBudget();
  Vector centre;
  const double radius = region.rows() == 0 ? 1 : Radius(region, &centre);
  if (region.rows() == 0) centre = Draw();
  if (!(radius > kThinnest)) return;
  int at = Holding(centre);
  if (at < 0) at = Explore(centre, radius);
  const Matrix rows = pieces_[static_cast<std::size_t>(at)].rows;  // a copy: pieces move
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    if (Find(region, rows.row(r)) >= 0) continue;
    Cover(Stack(region, -rows.row(r)));
    region = Stack(region, rows.row(r));
  }
}

/// Without linear programs: across every facet found so far, and at random.
void PathSearch::RayByRay() {
  const auto add = [&](const Vector& z) {
    Piece piece = PieceOf(z);
    if (!Decided(piece)) return;
    const bool known = std::any_of(pieces_.begin(), pieces_.end(), [&](const Piece& other) {
      return Alike(piece, other) && SmallestHeight(other.rows, z) >= -kFacet * z.norm();
    });
    if (!known) Add(std::move(piece));
  };
  std::size_t k = 0;
  for (int blind = 0; blind < kBlindDirections; ++blind) {
    for (; k < pieces_.size(); ++k) {
      const Matrix cone = pieces_[k].rows;  // a copy: pieces move
      Vector z = pieces_[k].inside;
      for (Eigen::Index ray = 0; ray < kRays * cone.rows(); ++ray) {
        AskBudget();
        const Vector aside = Draw();
        const double ahead = Reach(cone, z, aside, 1), back = Reach(cone, z, -aside, 1);
        z += 0.5 * (ahead - back) * aside;  // to the middle: z may have been close to a facet
        Vector along = Draw();
        if (ray % 2 == 0) along = 0.1 * along - cone.row(ray / 2 % cone.rows()).transpose();
        const double reach = Reach(cone, z, along, std::numeric_limits<double>::infinity());
        if (std::isfinite(reach)) add(z + (1 + kBeyond) * reach * along);
      }
    }
    add(Draw());
  }
}

/// Whether directions anywhere have the map of the cone that holds them.
void PathSearch::Check() {
  for (int k = 0; k < kChecks; ++k) {
    AskBudget();
    const Vector z = Draw(), y = basis_ * z;
    const Piece piece = PieceOf(z);
    const int at = Holding(z);
    const Vector value = piece.matrix * y;
    const double size = piece.matrix.cwiseAbs().maxCoeff() * y.cwiseAbs().maxCoeff();
    const Vector told = at < 0 ? Vector(Vector::Constant(y.size(), size))
                               : Vector(pieces_[static_cast<std::size_t>(at)].matrix * y);
    if ((told - value).cwiseAbs().maxCoeff() <= kOneValue * size) continue;
    throw NotPiecewiseLinear(
        "the pieces of a cluster with friction do not tell the derivative along all directions");
  }
}

/// Whether two cones have one path.
bool PathSearch::Alike(const Piece& a, const Piece& b) const {
  if (a.path.guards != b.path.guards || a.path.modes != b.path.modes) return false;
  const double size = 1 + std::max(a.matrix.cwiseAbs().maxCoeff(), b.matrix.cwiseAbs().maxCoeff());
  return (a.matrix - b.matrix).cwiseAbs().maxCoeff() <= kOneMatrix * size;
}

/// Where two cones of one path are on both sides of one facet, and else within the facets of each
/// other, their union is a cone. So it is where one holds the other.
bool PathSearch::Unite(Piece* a, const Piece& b) const {
  if (!Alike(*a, b)) return false;
  Eigen::Index common = -1;
  for (Eigen::Index r = 0; r < a->rows.rows() && common < 0; ++r) {
    if (Find(b.rows, -a->rows.row(r)) >= 0) common = r;
  }
  const auto within = [](const Matrix& facets, const Matrix& cone, Eigen::Index but) {
    for (Eigen::Index r = 0; r < facets.rows(); ++r) {
      if (r == but || Find(cone, facets.row(r)) >= 0) continue;
      if (!IsThin(Stack(cone, -facets.row(r)), kThinnest)) return false;
    }
    return true;
  };
  if (common < 0) {
    if (within(a->rows, b.rows, -1)) return true;
    if (!within(b.rows, a->rows, -1)) return false;
    *a = b;
    return true;
  }
  const Eigen::Index other = Find(b.rows, -a->rows.row(common));
  if (!within(a->rows, b.rows, common) || !within(b.rows, a->rows, other)) return false;
  Matrix rows = WithoutRow(a->rows, common);
  for (Eigen::Index r = 0; r < b.rows.rows(); ++r) {
    if (r != other && Find(rows, b.rows.row(r)) < 0) rows = Stack(rows, b.rows.row(r));
  }
  a->rows = Facets(rows);
  return true;
}

void PathSearch::UniteAll() {
  for (bool united = true; united;) {
    united = false;
    for (std::size_t a = 0; a < pieces_.size() && !united; ++a) {
      for (std::size_t b = a + 1; b < pieces_.size() && !united; ++b) {
        united = Unite(&pieces_[a], pieces_[b]);
        if (united) pieces_.erase(pieces_.begin() + static_cast<std::ptrdiff_t>(b));
      }
    }
  }
}

std::vector<FrictionalPath> PathSearch::Take() {
  if (HaveLinearPrograms()) {
    Cover(Matrix(0, basis_.cols()));
    Check();
    UniteAll();
  } else {
    RayByRay();
  }
  std::vector<FrictionalPath> paths;
  for (Piece& piece : pieces_) {
    piece.path.cone = piece.rows * basis_.transpose() * sizes_.cwiseInverse().asDiagonal();
    for (Eigen::Index r = 0; r < piece.rows.rows(); ++r) {
      piece.path.cone.row(r) /= piece.path.cone.row(r).stableNorm();
    }
    paths.push_back(std::move(piece.path));
  }
  return paths;
}

}  // namespace contact_flow
