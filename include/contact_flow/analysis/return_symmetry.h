// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What makes a return the start over again although its numbers differ: a symmetry g of the
/// system, so that a return map is P = g ∘ (first return). A walker's step ends with its legs
/// exchanged and further on:
///   g(q, v) = T (E q + c, E v),    E coordinates that change places, c numbers that are added,
/// T the translation of some coordinates by one number, after which the first of them is what it
/// was at the start. Tangents follow Dg = T′ E, T′ = I − t e₁ᵀ with t the translation and e₁ its
/// first coordinate: directions along t are set aside. Coordinates of quaternions cannot take part.
class ReturnSymmetry {
 public:
  ReturnSymmetry() = default;

  /// The coordinates `first` and `second` change places, and so do their velocities.
  ReturnSymmetry& Exchange(const MechanicalSystem& system, const std::string& first,
                           const std::string& second);
  /// `amount` is added to a coordinate.
  ReturnSymmetry& Shift(const MechanicalSystem& system, const std::string& coordinate,
                        double amount);
  /// These coordinates are translated together. All three throw std::invalid_argument for an
  /// unknown name, and one that is no coordinate with a velocity of its own.
  ReturnSymmetry& Travel(const MechanicalSystem& system,
                         const std::vector<std::string>& coordinates);

  /// Whether g is the identity.
  bool Empty() const { return exchanged_.empty() && shifted_.empty() && travelling_.empty(); }
  /// g(x), of a return that began at `start`.
  Vector Apply(const MechanicalSystem& system, const VectorRef& start, const VectorRef& x) const;
  /// How far T moves x back, of a return that began at `start`; 0 where nothing travels.
  double Way(const MechanicalSystem& system, const VectorRef& start, const VectorRef& x) const;
  /// The same g of another state of that motion, which it moves back by `way`.
  Vector Move(const MechanicalSystem& system, double way, const VectorRef& x) const;
  /// Undoes the exchange and what is added, not the translation.
  Vector Undo(const MechanicalSystem& system, const VectorRef& x) const;
  /// E on tangents (δq, δv) [2d×2d], its own inverse.
  Matrix Exchanged(const MechanicalSystem& system) const;
  /// Dg [2d×2d].
  Matrix Tangent(const MechanicalSystem& system) const;
  /// The translation t as a tangent, or no column [2d×·].
  Matrix Along(const MechanicalSystem& system) const;
  /// Of tangents that keep the first travelling coordinate: e₁ᵀ, or no row [·×2d].
  Matrix Slice(const MechanicalSystem& system) const;

 private:
  struct Coordinate {
    int position;  // its number in q
    int velocity;  // in v
  };
  static Coordinate Find(const MechanicalSystem& system, const std::string& name);

  std::vector<std::pair<Coordinate, Coordinate>> exchanged_;
  std::vector<std::pair<Coordinate, double>> shifted_;
  std::vector<Coordinate> travelling_;
};

/// What g makes of a contact mode, and how far it is from being a symmetry at a state.
struct SymmetryImage {
  ContactMode mode;     ///< contact i has become the one whose row of (a, Da, T) is the same
  double residual = 0;  ///< of M, f + c v and the rows of the contacts that touch, relative
  std::string reason;   ///< empty, or the contact that has become none
};

/// g at x with contacts `mode`; `image` is g(x).
SymmetryImage ImageOf(const MechanicalSystem& system, const VectorRef& u,
                      const ReturnSymmetry& symmetry, const VectorRef& x, ContactMode mode,
                      const VectorRef& image);

}  // namespace contact_flow
