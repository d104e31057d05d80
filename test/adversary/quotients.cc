// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/quotients.h"

namespace contact_flow {
namespace adversary {

bool Quotients::SayOtherwise(const ReferenceRun& base, const Vector& w, const Vector& prediction,
                             double error) const {
  for (const double alpha : {1e-4, 1e-8}) {
    const ReferenceRun run = Run(alpha * w);
    if (!run.doubt.empty()) continue;
    const double off = ((run.x - base.x) / alpha - prediction).cwiseAbs().maxCoeff();
    if (off < kSmall * error) return true;
  }
  for (const double alpha : {4e-3, 1e-3, 2e-4, 5e-5, 2e-5}) {
    const ReferenceRun run = Run(alpha * w), half = Run(0.5 * alpha * w);
    if (!run.doubt.empty() || !half.doubt.empty()) continue;
    const Vector limit = (4 * half.x - run.x - 3 * base.x) / alpha;  // 2 q(α/2) − q(α)
    if ((limit - prediction).cwiseAbs().maxCoeff() < kSmall * error) return true;
  }
  return false;
}

bool Quotients::AreSure(const ReferenceRun& base, const Vector& moved, double alpha,
                        double error) const {
  const ReferenceRun fine = Run(Vector::Zero(moved.size()), Trial::kFine);
  const ReferenceRun perturbed = Run(moved, Trial::kFine);
  const ReferenceRun other = Run(0.5 * moved, Trial::kFine);
  if (!fine.doubt.empty() || !perturbed.doubt.empty() || !other.doubt.empty()) return false;
  const Vector here = (Run(moved).x - base.x) / alpha, there = (perturbed.x - fine.x) / alpha;
  const Vector half = (other.x - fine.x) / (0.5 * alpha);
  return (here - there).cwiseAbs().maxCoeff() < 0.1 * error &&
         (half - there).cwiseAbs().maxCoeff() < 0.2 * error;
}

}  // namespace adversary
}  // namespace contact_flow
