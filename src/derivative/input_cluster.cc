// SPDX-License-Identifier: BSD-3-Clause
#include "input_cluster.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// A contact rises from an impact that hits others if its speed is above this part of what it is
/// the difference of, and so many times above what it drifted at.
constexpr double kRise = 1e-10, kAboveDrift = 10;

/// Changes of F add up to this part of its entries.
constexpr double kAdds = 1e-9;

/// Collects the parts of one cluster.
class Union {
 public:
  Union(const MechanicalSystem& system, const std::vector<const Transition*>& parts)
      : system_(system), parts_(parts) {}

  InputCluster Make() {
    const auto is_contact = [](const Transition* part) { return !part->changes_input; };
    lead_ = *std::find_if(parts_.begin(), parts_.end(), is_contact);
    whole_ = *lead_;
    whole_.changes_input = true;
    whole_.mode_before = parts_.front()->mode_before;
    whole_.mode_after = parts_.back()->mode_after;
    whole_.instants.clear();
    whole_.guards.clear();
    for (const Transition* part : parts_) Add(*part);
    whole_.released = whole_.mode_before - whole_.mode_after;
    whole_.vanishing = whole_.vanishing & whole_.mode_before;
    whole_.touching = whole_.touching - whole_.mode_before - whole_.activated;
    // By constraint, changes of the input last.
    std::stable_sort(
        whole_.instants.begin(), whole_.instants.end(),
        [](const EventInstant& a, const EventInstant& b) { return a.constraint < b.constraint; });
    whole_.spread = parts_.back()->t - parts_.front()->t;
    Check();
    cluster_.transition = whole_;
    return cluster_;
  }

 private:
  void Add(const Transition& part) {
    const int n = system_.num_constraints();
    CheckSlips(part);
    whole_.tolerance = std::max(whole_.tolerance, part.tolerance);
    whole_.touching = whole_.touching | part.touching;
    whole_.implied = whole_.implied | part.implied;
    whole_.grazed = whole_.grazed | part.grazed;
    whole_.completes_zeno = whole_.completes_zeno || part.completes_zeno;
    if (whole_.obstacle.ok()) whole_.obstacle = part.obstacle;
    if (part.changes_input) {
      whole_.instants.push_back({n + changes_++, part.t - whole_.t, 0});
      return;
    }
    const ConstraintSet met = part.activated | part.switched;
    if (!(met_ & met).Empty()) Refuse(*(met_ & met).begin(), "is met twice");
    met_ = met_ | met;
    if (hit_.Empty()) {  // what vanishes at x⁻, before any impact
      whole_.guards.insert(whole_.guards.end(), part.guards.begin(), part.guards.end());
    }
    hit_ = hit_ | part.activated;
    CheckRest(part);
    for (EventInstant instant : part.instants) {
      instant.offset += part.t - whole_.t;
      whole_.instants.push_back(instant);
    }
    if (&part == lead_) return;
    whole_.activated = whole_.activated | part.activated;
    whole_.switched = whole_.switched | part.switched;
    whole_.vanishing = whole_.vanishing | part.vanishing;
    whole_.impulse += part.impulse;
    whole_.impulse_word = whole_.impulse_word.Union(part.impulse_word);
    whole_.energy_change += part.energy_change;
    const int d = system_.dof();
    whole_.x_plus.tail(d) += part.x_plus.tail(d) - part.x_minus.tail(d);
  }

  /// What the impact of others lifts too slowly to be resolved, and was made rest, is in flight
  /// until the input changes: by the equations, not in the run.
  void CheckRest(const Transition& part) {
    if (part.activated.Empty() || !part.obstacle.ok()) return;
    const int d = system_.dof(), nq = system_.num_positions();
    const Vector q = part.x_minus.head(nq), v_minus = part.x_minus.tail(d);
    const InverseInertia inertia(system_, q, v_minus);
    const Matrix& A = inertia.terms().jacobian;
    const Vector v = v_minus + inertia * Vector(A.transpose() * part.impulse);
    for (int i : part.mode_after - system_.compliant() - part.activated) {
      const double rate = A.row(i).dot(v), drift = std::abs(A.row(i).dot(v_minus));
      const double size = A.row(i).cwiseAbs().dot(v.cwiseAbs() + v_minus.cwiseAbs());
      if (rate > kRise * size + kAboveDrift * drift) {
        return Refuse(i, "is lifted so slowly by the impact of others that it is made rest");
      }
    }
  }

  /// Slips in space that begin or end have no sign that tells their order.
  void CheckSlips(const Transition& part) {
    for (int i : part.mode_before& part.mode_after) {
      const bool in_space = system_.HasFriction() && system_.friction()[i].dimension == 2;
      if (in_space && part.mode_before.LetterOf(i) != part.mode_after.LetterOf(i)) {
        Refuse(i, "begins or ends to slip in space");
      }
    }
  }

  void Check() {
    if (!cluster_.status.ok()) return;
    if (system_.HasContactEffort()) {
      return Refuse(
          "the effort depends on the contact mode, as at soft contacts and at knots of linear "
          "references (kind: cubic has none)");
    }
    if (system_.num_constraints() + changes_ > ConstraintSet::kMaxConstraints) {
      return Refuse("there are too many constraints");
    }
    if (!whole_.touching.Empty()) {
      return Refuse(*whole_.touching.begin(), "touches without force");
    }
    const int d = system_.dof(), nq = system_.num_positions();
    const Vector v = whole_.x_minus.tail(d);
    ConstraintTerms terms;
    system_.Constraints(whole_.x_minus.head(nq), v, &terms);
    for (int i : whole_.activated) {
      if (!(terms.jacobian.row(i).dot(v) < 0)) {
        return Refuse(i, "is met only because of the impact of another");
      }
    }
  }

  void Refuse(int i, const std::string& what) {
    const std::string& name = system_.description().constraints[static_cast<std::size_t>(i)];
    Refuse("'" + name + "' " + what);
  }
  void Refuse(const std::string& why) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << whole_.t << " s an event coincides with a change of the input, and "
            << why << ": such clusters are not differentiated";
    cluster_.status = {Outcome::kNotDifferentiable, message.str()};
  }

  const MechanicalSystem& system_;
  const std::vector<const Transition*>& parts_;
  const Transition* lead_ = nullptr;
  Transition whole_;
  ConstraintSet met_, hit_;  // so far
  int changes_ = 0;
  InputCluster cluster_;
};

}  // namespace

bool AreClose(const Transition& before, const Transition& next, double simultaneity_tolerance) {
  return next.t - before.t <= std::max({simultaneity_tolerance, next.tolerance, before.tolerance});
}

bool HoldsAll(ContactDynamics* dynamics, const Vector& x, ContactMode mode) {
  dynamics->Evaluate(x, mode);
  for (int i : mode - dynamics->system().compliant()) {
    if (!(dynamics->force()(i) > 0)) return false;
  }
  return true;
}

bool AreIndependent(const MechanicalSystem& system, const std::vector<const Transition*>& parts,
                    const Vector& before, const Vector& after) {
  if (parts.size() != 2 || parts[0]->changes_input == parts[1]->changes_input) return false;
  const Transition& input = *parts[parts[0]->changes_input ? 0 : 1];
  const Transition& event = *parts[parts[0]->changes_input ? 1 : 0];
  const Vector& x = parts[0]->x_minus;
  const ConstraintSet of_time =
      DrivenSwitches(system, x.head(system.num_positions()), x.tail(system.dof()));
  const ConstraintSet others = event.activated | event.vanishing | event.touching | event.grazed |
                               (event.released - event.switched) | (event.switched - of_time);
  if (event.switched.Empty() || !others.Empty() || !event.obstacle.ok()) return false;
  if (input.mode_before != input.mode_after) return false;
  ContactDynamics first(system, before), second(system, after);
  const ContactMode mode = parts[0]->mode_before, other = parts[1]->mode_after;
  for (ContactDynamics* dynamics : {&first, &second}) {
    if (!HoldsAll(dynamics, x, mode) || !HoldsAll(dynamics, x, other)) return false;
  }
  const Vector changes[] = {first.Field(x, mode), first.Field(x, other), second.Field(x, mode),
                            second.Field(x, other)};
  const Vector sum = changes[3] - changes[2] - changes[1] + changes[0];
  Vector sizes = Vector::Zero(sum.size());
  for (const Vector& change : changes) sizes += change.cwiseAbs();
  return (sum.array().abs() <= kAdds * sizes.array()).all();
}

InputCluster UniteWithInput(const MechanicalSystem& system,
                            const std::vector<const Transition*>& transitions) {
  return Union(system, transitions).Make();
}

std::vector<InputCluster> FindInputClusters(const MechanicalSystem& system,
                                            const Trajectory& trajectory) {
  std::vector<InputCluster> clusters;
  const std::vector<Transition>& all = trajectory.transitions;
  for (std::size_t first = 0; first < all.size();) {
    std::size_t last = first;
    bool changes = all[first].changes_input, contacts = !changes;
    while (last + 1 < all.size() &&
           AreClose(all[last], all[last + 1], trajectory.simultaneity_tolerance)) {
      ++last;
      (all[last].changes_input ? changes : contacts) = true;
    }
    if (changes && contacts) {
      std::vector<const Transition*> parts;
      for (std::size_t k = first; k <= last; ++k) parts.push_back(&all[k]);
      const std::vector<Arc>& arcs = trajectory.arcs;
      if (AreIndependent(system, parts, arcs[first].u, arcs[last + 1].u)) {
        first = last + 1;
        continue;
      }
      clusters.push_back(UniteWithInput(system, parts));
      clusters.back().first = first;
      clusters.back().last = last;
    }
    first = last + 1;
  }
  return clusters;
}

const InputCluster* InputClusters::At(std::size_t k) const {
  for (const InputCluster& cluster : all_) {
    if (cluster.first <= k && k <= cluster.last) return &cluster;
  }
  return nullptr;
}

const InputCluster* InputClusters::Around(std::size_t k) const {
  const InputCluster* cluster = At(k);
  return cluster != nullptr && cluster->first < k ? cluster : nullptr;
}

EventMap InputClusters::Map(const InputCluster& cluster, const Variables& variables) const {
  const auto dynamics = [&](std::size_t arc) {
    return std::make_shared<ContactDynamics>(system_, run_.arcs[arc].u, variables);
  };
  std::vector<std::shared_ptr<ContactDynamics>> later;
  for (std::size_t k = cluster.first; k <= cluster.last; ++k) {
    if (run_.transitions[k].changes_input) later.push_back(dynamics(k + 1));
  }
  return EventMap(dynamics(cluster.first), cluster.transition, std::move(later));
}

Vector InputClusters::EndField(ContactDynamics* dynamics, std::size_t k) const {
  const InputCluster* cluster = Around(k);
  if (cluster == nullptr) return dynamics->Field(run_.arcs[k].x_end, run_.arcs[k].mode);
  const Arc& next = run_.arcs[cluster->last + 1];
  return ContactDynamics(system_, next.u, dynamics->variables()).Field(next.x_begin, next.mode);
}

}  // namespace contact_flow
