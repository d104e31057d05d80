// SPDX-License-Identifier: BSD-3-Clause
#include "symmetry_check.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "contact_flow/analysis/orbit_sizes.h"

namespace contact_flow {
namespace {

constexpr double kMoved = 1e-6;      // of B t = t, relative to B
constexpr double kSameState = 1e-4;  // of both motions, beside the sizes of the first
constexpr double kGrowth = 10;  // … or so many times what B makes of the distance from the orbit
constexpr double kSameTangent = 1e-3;   // … and of their derivatives, relative
constexpr double kShortOfEvent = 1e-3;  // of the time of return

double Size(const Matrix& values) { return values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0; }

/// "the motion differs by 0.1, relative".
std::string Differ(const std::string& what, double by) {
  std::ostringstream text;
  text.precision(3);
  text << what << " by " << by << ", relative";
  return text.str();
}

/// The image of B [2d×·] on directions; false where it has none on one of them.
bool Images(const BDerivative& B, const Matrix& directions, Matrix* images) {
  images->resize(directions.rows(), directions.cols());
  try {
    for (Eigen::Index k = 0; k < directions.cols(); ++k) images->col(k) = B(directions.col(k));
  } catch (const std::invalid_argument&) {
    return false;
  } catch (const std::domain_error&) {
    return false;
  }
  return true;
}

/// Both motions have events in the same number and of the same size, so that derivatives compare.
bool SameEvents(const Trajectory& one, const Trajectory& other, std::size_t last) {
  if (other.transitions.size() < last || other.arcs.size() <= last) return false;
  for (std::size_t k = 0; k < last; ++k) {
    const Transition &a = one.transitions[k], &b = other.transitions[k];
    if (a.activated.Size() != b.activated.Size() || a.released.Size() != b.released.Size()) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::string SymmetryObstacle(const MechanicalSystem& system, const VectorRef& u,
                             const Section& section, const PoincareOptions& options,
                             const VectorRef& x, const PoincareReturn& result, const BDerivative& B,
                             std::size_t last) {
  const ReturnSymmetry& symmetry = section.symmetry;
  const OrbitSizes sizes = SizesOf(system, result.trajectory);
  const auto by_size = [size = sizes.Larger()](const Matrix& tangents) {
    return Matrix(size.cwiseInverse().asDiagonal() * tangents);  // has no units
  };
  const Matrix along = symmetry.Along(system);
  Matrix moved;
  if (along.cols() > 0 && Images(B, along, &moved)) {
    const double apart =
        Size(by_size(moved - along)) / std::max(Size(by_size(along)), Size(by_size(moved)));
    if (!(apart <= kMoved)) return Differ("a motion that starts further along differs", apart);
  }
  const double off = OffOrbit(system, x, result, Matrix(2 * system.dof(), 0));
  if (!(off <= kOnOrbit)) return "";

  const Trajectory& run = result.trajectory;
  const Vector y = run.FinalState();
  const double way = symmetry.Way(system, x, y);
  // Just before an event of the section, from where both motions go on alike.
  const double apart = section.kind == Section::Kind::kEvent ? kShortOfEvent * result.time : 0;
  const double seen = result.time - apart;
  SimulateOptions simulate = options.simulate;
  simulate.dense = true;
  const Trajectory next = Simulate(system, y, u, result.time + apart, simulate);
  if (!(next.t_end() >= seen)) return "the next return ends: " + next.status.message;
  const Vector here = run.State(seen), there = symmetry.Move(system, way, next.State(seen));
  const double states = sizes.Compare(system.Separation(there, here));
  const Matrix E = symmetry.Exchanged(system), &basis = result.start_basis;
  Matrix images;
  double growth = 1;
  for (Eigen::Index k = 0; Images(B, basis, &images) && k < basis.cols(); ++k) {
    growth = std::max(growth, Size(by_size(images.col(k))) / Size(by_size(basis.col(k))));
  }
  if (!(states <= std::max(kSameState, kGrowth * growth * off))) {
    return Differ("the next return differs", states);
  }

  if (!SameEvents(run, next, last)) return "";
  const BDerivative second = DifferentiateArcs(system, next, 0, last, options.derivative);
  for (const double sign : {1.0, -1.0}) {
    Matrix first_images;
    if (!second.status.ok() || !Images(B, sign * basis, &first_images) ||
        !Images(second, sign * E * basis, &images)) {
      continue;
    }
    const double tangents = Size(by_size(E * images - first_images)) /
                            std::max(Size(by_size(basis)), Size(by_size(first_images)));
    if (!(tangents <= kSameTangent)) {
      return Differ("the derivative of the next return differs", tangents);
    }
  }
  return "";
}

}  // namespace contact_flow
