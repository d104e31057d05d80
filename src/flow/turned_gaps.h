// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/event_locator.h"

namespace contact_flow {

// A gap that falls until an impact elsewhere turns it, or stops it, and then opens has a minimum
// there, though the motion has none of its own.

/// Those of `open`, which are so before and behind an impact, that fall before it and not behind.
/// `terms` are those at the impact.
ConstraintSet StoppedGaps(const ConstraintSet& open, const ConstraintTerms& terms,
                          const VectorRef& v_minus, const VectorRef& v_plus);

/// Lowers `margin` to those of `stopped` that open where the arc behind begins: by their rates, or
/// by their accelerations where these are within `still` of zero [m/s]. Then none is.
void NoteTurned(const GapSample& begin, double still, ConstraintSet* stopped, double* margin);

}  // namespace contact_flow
