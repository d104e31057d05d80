// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/piecewise_linear/stability.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A unit vector this far outside a cone is taken to be on its boundary.
inline constexpr double kInCone = 1e-8;

/// Does A_w map the certificate's directions into their span, by the factor `bound`, and do they
/// stay in the cones on the way: a ray on one side, a line or plane altogether?
bool MapsIntoItself(const PiecewiseLinearMap& map, const StabilityCertificate& certificate);

/// The certificate of a map in z, as one of the map in x = sizes ∘ z.
StabilityCertificate CertificateInUnits(StabilityCertificate certificate, const Vector& sizes);

}  // namespace contact_flow
