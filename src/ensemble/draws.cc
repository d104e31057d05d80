// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/draws.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

using Kind = DrawPart::Kind;

constexpr double kMaxPeriod = 0x1p62;
constexpr double kNoPivot = 1e-12;  // a pivot below it, beside the diagonal, is zero

[[noreturn]] void Refuse(const DrawPart& part, const std::string& what) {
  std::string names;
  for (const std::string& name : part.names) names += (names.empty() ? "" : ", ") + name;
  throw std::invalid_argument("the draw of " + Cut(names, 80) + ": " + what);
}

void Check(const DrawPart& part, bool ok, const std::string& what) {
  if (!ok) Refuse(part, what);
}

/// Lower triangular L with L Lᵀ = P, P positive semidefinite, by Cholesky without pivots: columns
/// of zero pivots are zero.
Matrix Root(const DrawPart& part) {
  const Matrix& P = part.covariance;
  const auto n = static_cast<Eigen::Index>(part.names.size());
  Check(part, P.rows() == n && P.cols() == n && P.allFinite(),
        "the covariance needs " + std::to_string(n) + " rows and columns of finite numbers");
  const Vector sizes = P.diagonal().cwiseAbs().cwiseSqrt();
  const Matrix limits = 1e-9 * sizes * sizes.transpose();
  Check(part, ((P - P.transpose()).cwiseAbs().array() <= limits.array()).all(),
        "the covariance is not symmetric");
  Matrix L = Matrix::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    double pivot = P(j, j);
    for (Eigen::Index k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
    const double floor = kNoPivot * std::abs(P(j, j));
    Check(part, pivot >= -floor, "the covariance is not positive semidefinite");
    const bool zero = pivot <= floor;
    if (!zero) L(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      double rest = P(i, j);
      for (Eigen::Index k = 0; k < j; ++k) rest -= L(i, k) * L(j, k);
      if (!zero) L(i, j) = rest / L(j, j);
      Check(part, !zero || std::abs(rest) <= 1e-6 * std::sqrt(std::abs(P(i, i) * P(j, j))),
            "the covariance is not positive semidefinite");
    }
  }
  return L;
}

double Rows(const DrawPart& part) {
  if (part.kind == Kind::kTable) return static_cast<double>(part.table.rows());
  double rows = 1;
  if (part.kind == Kind::kGrid) {
    for (const Vector& levels : part.levels) rows *= static_cast<double>(levels.size());
  }
  return rows;
}

void ValidatePart(const DrawPart& part) {
  const auto n = static_cast<Eigen::Index>(part.names.size());
  Check(part, n > 0, "no names");
  if (part.kind == Kind::kGrid) {
    Check(part, part.levels.size() == part.names.size(), "levels are needed for each name");
    for (const Vector& levels : part.levels) {
      Check(part, levels.size() > 0 && levels.allFinite(), "levels must be finite, one at least");
    }
  } else if (part.kind == Kind::kTable) {
    Check(part, part.table.cols() == n && part.table.rows() > 0 && part.table.allFinite(),
          "the table needs " + std::to_string(n) + " columns of finite numbers, and a row");
  } else if (part.kind == Kind::kUniform) {
    Check(part,
          part.low.size() == n && part.high.size() == n && part.low.allFinite() &&
              part.high.allFinite() && (part.high - part.low).allFinite(),
          "low and high must be finite, one for each name");
    Check(part, (part.low.array() <= part.high.array()).all(), "low is above high");
  } else {
    Check(part, part.mean.size() == n && part.mean.allFinite(),
          "the mean must be finite, one number for each name");
  }
}

}  // namespace

Sampler::Sampler(const Draws& draws) : draws_(draws) {
  std::set<std::string> seen;
  double period = 1;
  for (const DrawPart& part : draws.parts) {
    ValidatePart(part);
    for (const std::string& name : part.names) {
      // "x" and "+x" are one number.
      if (!seen.insert(name.substr(name.rfind('+', 0) == 0 ? 1 : 0)).second) {
        Refuse(part, QuoteName(name) + " is drawn twice");
      }
      names_.push_back(name);
    }
    roots_.push_back(part.kind == Kind::kNormal ? Root(part) : Matrix());
    period *= Rows(part);
    Check(part, period < kMaxPeriod, "the grid has too many points");
    period_ *= static_cast<std::uint64_t>(Rows(part));
    if (part.kind == Kind::kUniform || part.kind == Kind::kNormal) {
      random_ += static_cast<int>(part.names.size());
    }
  }
  if (draws.sobol && random_ > 0) sobol_ = std::make_shared<ShiftedSobol>(random_, draws.seed);
}

void Sampler::Draw(std::uint64_t run, Vector* values) const {
  values->resize(static_cast<Eigen::Index>(names_.size()));
  Philox random(draws_.seed, run);
  int taken = 0;
  const auto bits = [&] { return sobol_ ? sobol_->Bits(run, taken++) : random.Next(); };
  // Grids and tables: the last part varies fastest.
  std::uint64_t rest = period_;
  Eigen::Index at = 0;
  for (std::size_t p = 0; p < draws_.parts.size(); ++p) {
    const DrawPart& part = draws_.parts[p];
    const auto n = static_cast<Eigen::Index>(part.names.size());
    auto out = values->segment(at, n);
    at += n;
    if (part.kind == Kind::kUniform) {
      for (Eigen::Index k = 0; k < n; ++k) {
        out(k) = part.low(k) + (part.high(k) - part.low(k)) * Philox::UnitInterval(bits());
      }
      continue;
    }
    if (part.kind == Kind::kNormal) {
      for (Eigen::Index k = 0; k < n; ++k) out(k) = NormalQuantile(Philox::OpenInterval(bits()));
      for (Eigen::Index i = n - 1; i >= 0; --i) {  // in place, row by row from below
        double sum = 0;
        for (Eigen::Index k = 0; k <= i; ++k) sum += roots_[p](i, k) * out(k);
        out(i) = part.mean(i) + sum;
      }
      continue;
    }
    const auto rows = static_cast<std::uint64_t>(Rows(part));
    rest /= rows;
    std::uint64_t row = run % period_ / rest % rows;
    if (part.kind == Kind::kTable) {
      out = part.table.row(static_cast<Eigen::Index>(row)).transpose();
      continue;
    }
    for (Eigen::Index k = n - 1; k >= 0; --k) {
      const Vector& levels = part.levels[static_cast<std::size_t>(k)];
      const auto size = static_cast<std::uint64_t>(levels.size());
      out(k) = levels(static_cast<Eigen::Index>(row % size));
      row /= size;
    }
  }
}

}  // namespace contact_flow
