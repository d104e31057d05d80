// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <vector>

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// A trajectory at finitely many times. Time never decreases; at an event there are two samples,
/// the left limit that ends one arc and the right limit that begins the next.
struct Samples {
  std::vector<double> t;  ///< [s]
  Matrix x;               ///< one state a row [samples×2d]
  std::vector<int>
      first_of_arc;  ///< row at which each arc begins, and the number of rows at the end
};

/// Both ends of every arc, and of `count` times spread evenly over the whole run, both its ends
/// included, those that lie inside an arc. Needs SimulateOptions::dense when count > 1.
Samples SampleTrajectory(const Trajectory& trajectory, int count);

/// Writes a head line and one line a sample: time, contact mode, coordinates, velocities. Numbers
/// have 17 digits, so that reading them gives the same bits back; names are quoted as in RFC 4180.
void WriteCsv(const SystemDescription& description, const Trajectory& trajectory, int count,
              std::ostream* out);

}  // namespace contact_flow
