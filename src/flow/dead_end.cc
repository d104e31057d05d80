// SPDX-License-Identifier: BSD-3-Clause
#include "dead_end.h"

#include <Eigen/Eigenvalues>
#include <sstream>

#include "dependent_row.h"

namespace contact_flow {

std::string SingularMass(const MechanicalSystem& system, const Vector& x, const Vector& u,
                         const ContactMode& mode) {
  constexpr double kSingular = 1e-11;  // beside the diagonal, nearly
  constexpr double kPart = 0.1;        // of the largest entry of what moves together
  const int nq = system.num_positions(), d = system.dof();
  Matrix mass;
  Vector force;
  system.Dynamics(x.head(nq), x.tail(d), u, mode, &mass, &force);
  const Vector size = mass.diagonal().cwiseAbs().cwiseSqrt();
  if (!mass.allFinite() || !(size.minCoeff() > 0)) return "";
  mass = size.cwiseInverse().asDiagonal() * mass * size.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(mass);
  if (eigen.eigenvalues()(0) > d * kSingular) return "";
  const Vector moved = eigen.eigenvectors().col(0).cwiseAbs();
  std::string names;
  for (int i = 0; i < d; ++i) {
    if (moved(i) < kPart * moved.maxCoeff()) continue;
    names += (names.empty() ? "'" : ", '") + system.description().velocities[i] + "'";
  }
  return "; the mass matrix is singular there, or nearly so: " + names +
         " can move together and move no mass. Give what they carry an inertia, or begin elsewhere";
}

std::string LostLoop(const MechanicalSystem& system, const Vector& x, const Vector& size) {
  constexpr double kNearly = 1e-2;
  if (system.num_bilateral() == 0) return "";
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  const Matrix rows = RowLayout(system).Bilateral(terms.jacobian);
  const DependentRow lost = size.size() > 0 ? MostDependent(rows, size) : MostDependent(rows);
  if (!(lost.part <= kNearly)) return "";
  std::ostringstream text;
  text.precision(2);
  text << "; bilateral constraint '" << system.description().bilateral[lost.row]
       << "' depends on those before it there, or has vanished, all but " << lost.part
       << " of it: its loop is stretched out, or its `axes` have turned away from it: give them "
          "the `frame` of one of its links";
  return text.str();
}

}  // namespace contact_flow
