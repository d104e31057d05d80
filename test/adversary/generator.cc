// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/generator.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "test/adversary/draw.h"
#include "test/adversary/recipes.h"
#include "test/adversary/reference_flow.h"

namespace contact_flow {
namespace adversary {
namespace {

class Builder {
 public:
  Builder(const Recipe& recipe, Case* result, Draw* draw)
      : r_(recipe), case_(*result), draw_(*draw) {}

  void Build() {
    Sizes();
    Masses();
    Gaps();
    Velocity();
    Forces();
    Restitutions();
    Press();
    Start();
    if (case_.skipped.empty()) case_.units = DrawUnits(d_, n_, &draw_);
  }

 private:
  void Sizes() {
    touching_ = r_.hits + r_.rests + r_.touches;
    n_ = touching_ + r_.others;
    const int smallest = std::max(2, touching_ + (r_.clock ? 1 : 0));
    d_ = r_.coupling == Coupling::kBlocks
             ? std::max(smallest, touching_ + draw_.Below(touching_ + 1) + (r_.clock ? 1 : 0))
             : smallest + draw_.Below(std::max(1, 9 - smallest));
    d_ = std::min(d_, 8 + (r_.clock ? 1 : 0));
    m_ = d_ - (r_.clock ? 1 : 0);  // coordinates that move freely
    c_.restitution = Vector::Zero(n_);
    for (int k = 0; k < m_; ++k) block_.push_back(k % std::max(1, touching_));
  }

  bool Together(int i, int j) const {
    return r_.coupling != Coupling::kBlocks || block_[i] == block_[j];
  }

  Matrix Symmetric(double size) {
    Matrix S = Matrix::Zero(d_, d_);
    for (int i = 0; i < m_; ++i) {
      for (int j = 0; j <= i; ++j) {
        const double s = draw_.Normal() * size;
        if (Together(i, j)) S(i, j) = S(j, i) = s;
      }
    }
    return S;
  }

  void Masses() {
    c_.mass = Matrix::Identity(d_, d_);
    const Matrix S = Symmetric(0.3);
    c_.mass += S * S.transpose();
    for (int k = 0; k < m_; ++k) c_.mass(k, k) *= draw_.Log(0.3, 3);
    if (r_.mass_slope == 0 || draw_.Chance(0.3)) return;
    if (r_.coupling == Coupling::kOrthogonal) return;  // would be orthogonal at the event only
    for (int k = 0; k < d_; ++k) {
      Matrix slope = Symmetric(r_.mass_slope / std::sqrt(1.0 * m_));
      if (k >= m_) slope.setZero();
      if (r_.coupling == Coupling::kBlocks) {  // of its own block alone
        for (int i = 0; i < m_; ++i) {
          for (int j = 0; j < m_; ++j) {
            if (k < m_ && (block_[i] != block_[k] || block_[j] != block_[k])) slope(i, j) = 0;
          }
        }
      }
      c_.mass_slopes.push_back(slope);
    }
  }

  void Gaps() {
    const Matrix L = c_.mass.llt().matrixL();
    Matrix normals = Matrix::Zero(n_, d_);
    if (r_.coupling == Coupling::kBlocks) {
      for (int i = 0; i < touching_; ++i) {
        for (int k = 0; k < m_; ++k) {
          if (block_[k] == i) normals(i, k) = draw_.Normal();
        }
        normals.row(i) *= draw_.Sign() / normals.row(i).norm();
      }
    } else if (touching_ > 0) {
      // A = C Q Lᵀ with C Cᵀ = G and orthonormal rows of Q: A M⁻¹ Aᵀ = G.
      Matrix random(m_, touching_);
      for (int i = 0; i < random.size(); ++i) random(i) = draw_.Normal();
      const Matrix Q =
          Eigen::HouseholderQR<Matrix>(random).householderQ() * Matrix::Identity(m_, touching_);
      Matrix wide = Matrix::Zero(touching_, d_);
      wide.leftCols(m_) = Q.transpose();
      const Matrix C = DrawCoupling(r_.coupling, touching_, &draw_).llt().matrixL();
      normals.topRows(touching_) = C * wide * L.transpose();
      for (int i = 0; i < touching_; ++i) normals.row(i) *= draw_.Log(0.5, 2);
    }
    for (int i = touching_; i < n_; ++i) {
      for (int k = 0; k < m_; ++k) normals(i, k) = draw_.Normal();
      normals.row(i).normalize();
    }
    const bool may_curve = r_.coupling != Coupling::kOrthogonal;
    const bool flat = r_.curvature == 0 || draw_.Chance(0.4) || !may_curve;
    for (int i = 0; i < n_; ++i) {
      GapTerms gap;
      gap.normal = normals.row(i);
      gap.offset = i < touching_ ? 0 : draw_.Log(0.03, 0.5);
      if (!flat) {
        gap.curvature = Symmetric(r_.curvature);
        if (r_.coupling == Coupling::kBlocks) {
          for (int k = 0; k < m_; ++k) {
            for (int l = 0; l < m_; ++l) {
              const bool own = i < touching_ && block_[k] == i && block_[l] == i;
              if (!own) gap.curvature(k, l) = 0;
            }
          }
        }
      }
      c_.gaps.push_back(gap);
    }
  }

  void Velocity() {
    Vector rates = Vector::Zero(touching_);
    for (int i = 0; i < r_.hits; ++i) rates(i) = -draw_.Uniform(0.3, 1.3);
    if (r_.graze) rates(0) = -draw_.Log(1e-9, 1e-2) * (draw_.Chance(0.3) ? 0 : 1);
    for (int i = r_.hits + r_.rests; i < touching_; ++i) {
      if (r_.start && draw_.Chance(0.5)) rates(i) = draw_.Uniform(0.2, 1);
    }
    v_ = Vector::Zero(d_);
    for (int k = 0; k < m_; ++k) v_(k) = draw_.Normal();
    if (touching_ > 0) {
      Matrix A(touching_, d_);
      for (int i = 0; i < touching_; ++i) A.row(i) = c_.gaps[i].normal;
      // Parallel normals with different rates would need any speed.
      if (r_.coupling == Coupling::kParallel && touching_ > 1) {
        const double side = A.row(0).dot(A.row(1)) / (A.row(0).norm() * A.row(1).norm());
        if (side > 0) rates(1) = rates(0) * A.row(1).norm() / A.row(0).norm();
      }
      const Matrix Y = c_.mass.llt().solve(A.transpose());
      v_ += Y * (A * Y).ldlt().solve(rates - A * v_);
    }
    if (r_.clock) v_(d_ - 1) = 1;
    if (v_.norm() > 20) case_.skipped = "a speed beyond 20";
  }

  Vector Along() {
    Vector e = v_;
    if (r_.clock) e(d_ - 1) = 0;
    for (int k = 0; k < m_; ++k) e(k) += 0.5 * draw_.Normal();
    return e.norm() > 0 ? Vector(e.normalized()) : Vector::Unit(d_, 0);
  }

  void Forces() {
    c_.load = Vector::Zero(d_);
    c_.stiffness = c_.damping = Matrix::Zero(d_, d_);
    for (int i = 0; i < m_; ++i) {
      if (r_.idle) break;
      c_.load(i) = 2 * draw_.Normal();
      for (int j = 0; j < m_; ++j) {
        c_.stiffness(i, j) = draw_.Normal();
        c_.damping(i, j) = (0.4 + r_.gyration) * draw_.Normal();
      }
      c_.stiffness(i, i) -= 3;
      c_.damping(i, i) -= 0.5;
    }
    if (!r_.idle && draw_.Chance(0.5)) {
      for (int i = 0; i < d_; ++i) {
        Matrix S = Matrix::Zero(d_, d_);
        for (int j = 0; j < m_; ++j) {
          for (int l = 0; l <= j; ++l) S(j, l) = S(l, j) = 0.3 * draw_.Normal() / m_;
        }
        if (i >= m_) S.setZero();
        c_.quadratic.push_back(S);
      }
    }
    const double span = r_.before + r_.after;
    for (int b = 0; b < r_.bumps + r_.waves; ++b) {
      ForceRidge term;
      term.ridge.bump = b < r_.bumps;
      const bool in_time = r_.clock && draw_.Chance(0.7);
      term.ridge.e = in_time ? Vector(Vector::Unit(d_, d_ - 1)) : Along();
      const double speed = std::max(0.05, std::abs(term.ridge.e.dot(v_)));
      const double path = speed * span, width = path * draw_.Log(1e-3, 0.1);
      const double t = draw_.Uniform(r_.start ? 0.02 : -0.8 * r_.before, 0.8 * r_.after);
      term.ridge.centre = t * term.ridge.e.dot(v_);
      term.ridge.width = width;
      term.amplitude = Vector::Zero(d_);
      // A bump gives an impulse of order 1 at most; a wave is bounded.
      const double size = term.ridge.bump ? draw_.Log(0.01, 1) * speed / width : draw_.Log(0.1, 5);
      for (int k = 0; k < m_; ++k) term.amplitude(k) = size * draw_.Normal();
      c_.ridges.push_back(term);
    }
    for (int h = 0; h < r_.hills + r_.ripples; ++h) {
      Ridge ridge;
      ridge.bump = h < r_.hills;
      ridge.e = Along();
      const double path = std::max(0.05, std::abs(ridge.e.dot(v_))) * span;
      ridge.width = path * draw_.Log(5e-3, 0.3);
      ridge.centre = draw_.Uniform(-r_.before, r_.after) * ridge.e.dot(v_);
      const int i = draw_.Below(n_);
      const double amplitude = draw_.Log(0.01, 0.5) * ridge.width;
      c_.gaps[i].ridges.emplace_back(amplitude, ridge);
      // The event stays at q = 0, with another normal there.
      const Vector zero = Vector::Zero(d_);
      c_.gaps[i].offset -= amplitude * ridge.Derivative(zero, 0);
      if (i < touching_) c_.gaps[i].normal -= amplitude * ridge.Derivative(zero, 1) * ridge.e;
    }
    const int inputs = r_.inputs ? 1 + draw_.Below(2) : draw_.Below(2);
    c_.input = Matrix::Zero(d_, inputs);
    for (int i = 0; i < m_; ++i) {
      for (int j = 0; j < inputs; ++j) c_.input(i, j) = draw_.Normal();
    }
  }

  void Restitutions() {
    const bool plastic = draw_.Chance(r_.plastic);
    for (int i = 0; i < n_; ++i) {
      c_.restitution(i) = DrawRestitution(plastic, &draw_);
    }
  }

  /// Loads contacts at the event: those that rest strongly enough, the others somehow.
  void Press() {
    const RandomSystem system(c_);
    ReferenceDynamics dynamics(system);
    Vector x(2 * d_);
    x << Vector::Zero(d_), v_;
    ConstraintSet mode;
    for (int i = 0; i < r_.rests; ++i) mode.Insert(r_.hits + i);
    dynamics.Solve(x, Vector::Zero(c_.input.cols()), mode);
    Vector wanted = Vector::Zero(n_);
    for (int i : mode) {
      wanted(i) = draw_.Uniform(0.5, 3) * r_.press;
      if (r_.vanish && (i == r_.hits || draw_.Chance(0.6))) wanted(i) = 0;
    }
    for (int i : mode) c_.load -= (wanted(i) - dynamics.force()(i)) * c_.gaps[i].normal;
    for (int i = 0; i < r_.hits && r_.press > 0; ++i) {
      c_.load -= draw_.Uniform(-0.5, 3) * r_.press * c_.gaps[i].normal;
    }
    // What touches without force has no acceleration, or leaves.
    const RandomSystem loaded(c_);
    ReferenceDynamics again(loaded);
    again.Solve(x, Vector::Zero(c_.input.cols()), mode);
    ConstraintTerms terms;
    loaded.Constraints(x.head(d_), x.tail(d_), &terms);
    if (r_.touches > 0) {
      const int first = r_.hits + r_.rests;
      const Matrix A = terms.jacobian.middleRows(first, r_.touches);
      Vector aim = Vector::Zero(r_.touches);
      for (int i = 0; i < r_.touches; ++i) {
        if (!r_.start) aim(i) = draw_.Uniform(0.5, 2);
        if (r_.start && draw_.Chance(0.5)) aim(i) = draw_.Uniform(-2, 2);
      }
      const Vector now = A * again.acceleration() + terms.bias.segment(first, r_.touches);
      const Matrix Y = c_.mass.llt().solve(A.transpose());
      c_.load += A.transpose() * (A * Y).ldlt().solve(aim - now);
    }
    mode_ = mode;
  }

  void Start() {
    case_.duration = r_.after * draw_.Uniform(0.5, 1.5);
    double before = r_.start ? 0 : r_.before * draw_.Uniform(0.4, 1.2);
    if (r_.delays) {
      case_.delay = draw_.Log(1e-12, 1e-5);
      for (int i = 1; i < r_.hits; ++i) {
        c_.gaps[i].offset +=
            case_.delay * draw_.Uniform(0.2, 1) * i * std::abs(c_.gaps[i].normal.dot(v_));
      }
    }
    auto system = std::make_shared<RandomSystem>(c_);
    const Vector u = Vector::Zero(c_.input.cols());
    Vector x;
    // From a shorter time before, where the way is not free.
    for (int attempt = 0; attempt < 4; ++attempt, before *= 0.4) {
      case_.skipped = Arrive(*system, u, before, &x);
      if (case_.skipped.empty() || before == 0) break;
    }
    if (!case_.skipped.empty()) return;
    if (!x.allFinite() || x.cwiseAbs().maxCoeff() > 50) {
      case_.skipped = "the motion before is unbounded";
      return;
    }
    case_.system = system;
    case_.x = x;
    case_.event_time = before;
    case_.duration += before;
    case_.schedule = InputSchedule::Constant(u);
    if (r_.inputs) {
      const double offsets[] = {0, 0, 1e-9, -1e-9, 1e-6, -1e-6, 0.01, -0.01};
      const double t = before + offsets[draw_.Below(8)];
      const Vector later = u.unaryExpr([this](double) { return draw_.Normal(); });
      case_.schedule.grid = {0, std::max(1e-6, t)};
      case_.schedule.values = {u, later};
    }
    if (draw_.Chance(0.08)) case_.options.impact_law = ImpactLaw::kProjection;
    const double tolerance = draw_.Chance(0.2) ? 1e-12 : 1e-9;
    case_.options.relative_tolerance = case_.options.absolute_tolerance = tolerance;
  }

  /// The state from which the motion comes to the event; else why there is none.
  std::string Arrive(const RandomSystem& system, const Vector& u, double before, Vector* x) {
    x->resize(2 * d_);
    *x << Vector::Zero(d_), v_;
    ReferenceFlow flow(system, {});
    if (before > 0 && !flow.Glide(x, u, mode_, -before)) return "no motion leads to the event";
    flow.PutInContact(x, mode_);
    ConstraintTerms terms;
    system.Constraints(x->head(d_), x->tail(d_), &terms);
    for (int i = 0; i < n_; ++i) {
      const bool at_start = r_.start && i < touching_;
      if (mode_.Contains(i) || at_start) continue;
      if (!(terms.gap(i) > 1e-3)) return "a constraint is violated before";
    }
    return "";
  }

  const Recipe r_;
  Case& case_;
  Draw& draw_;
  Coefficients c_;
  int d_ = 0, m_ = 0, n_ = 0, touching_ = 0;
  std::vector<int> block_;  // of coordinates, one for each touching constraint
  Vector v_;
  ConstraintSet mode_;
};

}  // namespace

Case Generate(std::uint64_t seed) {
  const auto& [name, maker] = Recipes()[seed % Recipes().size()];
  Case result;
  result.seed = seed;
  result.generator = name;
  Draw draw(seed);
  Builder(maker(&draw), &result, &draw).Build();
  return result;
}

}  // namespace adversary
}  // namespace contact_flow
