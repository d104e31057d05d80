// SPDX-License-Identifier: BSD-3-Clause
// Common quadratic norms beside CSDP (B. Borchers), another solver of semidefinite programs, which
// is run as a program.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "src/piecewise_linear/common_quadratic_norm.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

/// The largest t, and its P, of  γ²P − A_iᵀPA_i ≥ t I,  P ≥ t I,  P ≤ I.  A norm with rate γ exists
/// iff t > 0.
struct CsdpAnswer {
  bool solved = false;
  double t = 0;
  Matrix P;
};

/// Writes the program in the sparse format of SDPA: min c·y, Σ_k y_k F_k − F_0 ≥ 0, y = (P_rc for r
/// ≤ c, then t).
void WriteProgram(const std::vector<Matrix>& matrices, double gamma, const std::string& path) {
  const int n = static_cast<int>(matrices.front().rows()), count = n * (n + 1) / 2;
  const int blocks = static_cast<int>(matrices.size()) + 2;
  std::ofstream file(path);
  file.precision(17);
  file << count + 1 << "\n" << blocks << "\n";
  for (int block = 0; block < blocks; ++block) file << n << " ";
  file << "\n";
  for (int k = 0; k < count; ++k) file << "0 ";
  file << "-1\n";
  const auto write = [&](int k, int block, const Matrix& F) {
    for (int r = 0; r < n; ++r) {
      for (int c = r; c < n; ++c) {
        if (F(r, c) != 0)
          file << k << " " << block << " " << r + 1 << " " << c + 1 << " " << F(r, c) << "\n";
      }
    }
  };
  const Matrix I = Matrix::Identity(n, n);
  write(0, blocks, -I);
  int k = 0;
  for (int c = 0; c < n; ++c) {
    for (int r = 0; r <= c; ++r) {
      Matrix E = Matrix::Zero(n, n);
      E(r, c) = E(c, r) = 1;
      ++k;
      for (int i = 0; i + 2 < blocks; ++i) {
        write(k, i + 1, gamma * gamma * E - matrices[i].transpose() * E * matrices[i]);
      }
      write(k, blocks - 1, E);
      write(k, blocks, -E);
    }
  }
  for (int block = 1; block < blocks; ++block) write(k + 1, block, -I);
}

CsdpAnswer AskCsdp(const std::vector<Matrix>& matrices, double gamma) {
  CsdpAnswer answer;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("contact_flow_csdp_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string program = (folder / "p.dat-s").string(), solution = (folder / "p.sol").string();
  WriteProgram(matrices, gamma, program);
  const std::string command = std::string("cd ") + folder.string() + " && " CONTACT_FLOW_CSDP " " +
                              program + " " + solution + " > /dev/null 2>&1";
  const int code = std::system(command.c_str());
  std::ifstream file(solution);
  const int n = static_cast<int>(matrices.front().rows());
  answer.P.resize(n, n);
  for (int c = 0; c < n; ++c) {
    for (int r = 0; r <= c; ++r) {
      file >> answer.P(r, c);
      answer.P(c, r) = answer.P(r, c);
    }
  }
  file >> answer.t;
  // 0: solved; 3: solved with reduced accuracy.
  answer.solved = file.good() && (code == 0 || (WIFEXITED(code) && WEXITSTATUS(code) == 3));
  std::filesystem::remove_all(folder);
  return answer;
}

TEST(QuadraticNorms, AreAsGoodAsThoseOfCsdp) {
  if (!CONTACT_FLOW_HAVE_CSDP) GTEST_SKIP() << "CSDP is not installed";
  std::mt19937 generator(7);
  constexpr double kBeside = 0.05;  // relative distance from the rate at which CSDP is asked
  constexpr double kNone = 1e-7;    // its accuracy: a smaller t is none
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 2 + trial % 3;
    std::vector<Matrix> matrices;
    for (int i = 0; i < 2 + trial % 2; ++i)
      matrices.push_back(test::RandomMatrix(n, n, &generator));
    const CommonQuadraticNorm own = FindCommonQuadraticNorm(matrices);
    EXPECT_NEAR(own.rate, QuadraticRate(matrices, own.P), 1e-9 * own.rate);
    const CsdpAnswer above = AskCsdp(matrices, own.rate * (1 + kBeside));
    const CsdpAnswer below = AskCsdp(matrices, own.rate * (1 - kBeside));
    ASSERT_TRUE(above.solved && below.solved) << trial;
    EXPECT_GT(above.t, kNone) << trial;
    EXPECT_LE(below.t, kNone) << trial << ": CSDP found a better norm";
    // A certificate of CSDP's is accepted by the checker.
    EXPECT_LE(QuadraticRate(matrices, above.P), own.rate * (1 + kBeside) * (1 + 1e-6)) << trial;
  }
}

}  // namespace
}  // namespace contact_flow
