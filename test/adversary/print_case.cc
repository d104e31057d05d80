// SPDX-License-Identifier: BSD-3-Clause
#include <sstream>

#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {
namespace {

const Eigen::IOFormat kRow(12, 0, ", ", "; ", "", "", "[", "]");

void PrintRidge(const Ridge& ridge, std::ostream* out) {
  *out << (ridge.bump ? "bump" : "wave") << " along " << ridge.e.transpose().format(kRow)
       << " centre " << ridge.centre << " width " << ridge.width << "\n";
}

}  // namespace

std::string Print(const Case& c) {
  std::ostringstream out;
  out.precision(12);
  out << "seed " << c.seed << ", generator " << c.generator;
  if (!c.skipped.empty()) {
    out << ": no case, " << c.skipped << "\n";
    return out.str();
  }
  const Coefficients& k = c.system->coefficients();
  const SimulateOptions& o = c.options;
  out << ": " << k.dof() << " coordinates, " << k.gaps.size() << " constraints, " << k.input.cols()
      << " inputs, duration " << c.duration << ", event at " << c.event_time << ", delay "
      << c.delay << ", law "
      << (o.impact_law == ImpactLaw::kProjection ? "projection" : "complementarity")
      << ", tolerances: relative " << o.relative_tolerance << ", absolute " << o.absolute_tolerance
      << ", gap " << o.gap_tolerance << ", speed " << o.speed_tolerance << ", simultaneity "
      << o.simultaneity_tolerance << "; method " << static_cast<int>(o.method)
      << "\nx = " << c.x.transpose().format(kRow) << "\nmass = " << k.mass.format(kRow) << "\n";
  for (const Matrix& slope : k.mass_slopes) out << "  slope " << slope.format(kRow) << "\n";
  out << "load = " << k.load.transpose().format(kRow)
      << "\nstiffness = " << k.stiffness.format(kRow) << "\ndamping = " << k.damping.format(kRow)
      << "\n";
  for (const Matrix& C : k.quadratic) out << "  quadratic " << C.format(kRow) << "\n";
  for (const ForceRidge& term : k.ridges) {
    out << "  force " << term.amplitude.transpose().format(kRow) << " ";
    PrintRidge(term.ridge, &out);
  }
  out << "input = " << k.input.format(kRow) << "\n";
  for (std::size_t i = 0; i < k.gaps.size(); ++i) {
    const GapTerms& gap = k.gaps[i];
    out << "gap " << i << ": restitution " << k.restitution(i) << ", " << gap.offset << " + "
        << gap.normal.transpose().format(kRow) << " q";
    if (gap.curvature.size() > 0) out << " + q " << gap.curvature.format(kRow) << " q / 2";
    out << "\n";
    for (const auto& [amplitude, ridge] : gap.ridges) {
      out << "  " << amplitude << " ";
      PrintRidge(ridge, &out);
    }
  }
  for (std::size_t i = 0; i < c.schedule.grid.size(); ++i) {
    out << "input from " << c.schedule.grid[i] << ": "
        << c.schedule.values[i].transpose().format(kRow) << "\n";
  }
  out << "units: length " << c.units.length.transpose().format(kRow) << ", gaps "
      << c.units.gap.transpose().format(kRow) << ", mass " << c.units.mass << ", time "
      << c.units.time << "; places of coordinates";
  for (int i : c.units.coordinate) out << " " << i;
  out << ", of constraints";
  for (int i : c.units.constraint) out << " " << i;
  out << "\n";
  return out.str();
}

}  // namespace adversary
}  // namespace contact_flow
