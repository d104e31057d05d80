// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/b_derivative.h"
#include "test/adversary/judge.h"

namespace contact_flow {
namespace adversary {
namespace {

/// Keeps contacts to first order, by the shortest change of (δq, δv).
void Project(const Case& c, ContactMode kept, Vector* w) {
  Variables variables;
  variables.inputs = true;
  variables.parameters = {0, 1};
  *w = ProjectAdmissible(*c.system, c.x, kept, *w, variables);
}

}  // namespace

void Admit(const Case& c, ContactMode kept, Vector* w) {
  const int d = c.system->dof();
  ConstraintTerms terms;
  c.system->Constraints(c.x.head(d), c.x.tail(d), &terms);
  Project(c, kept, w);
  for (int round = 0; round < 20; ++round) {
    bool turned = false;
    for (int i = 0; i < terms.gap.size(); ++i) {
      if (kept.Contains(i) || terms.gap(i) > 1e-9) continue;
      const Eigen::RowVectorXd a = terms.jacobian.row(i);
      const double rate = a.dot(w->head(d)) + (i == 0 ? (*w)(w->size() - 1) : 0);
      if (rate >= 0) continue;
      w->head(d) -= 2 * rate / a.squaredNorm() * a.transpose();
      turned = true;
    }
    if (!turned) return;
    Project(c, kept, w);
  }
}

}  // namespace adversary
}  // namespace contact_flow
