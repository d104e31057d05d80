// SPDX-License-Identifier: BSD-3-Clause
// A budget of seconds, memory and patience, and a simulation within it.
#include "contact_flow/budget.h"

#include <gtest/gtest.h>

#include <limits>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/nearest_name.h"
#include "src/clocks.h"
#include "test/budgets.h"

namespace contact_flow {
namespace {

using test::Ended;
using test::RunWithin;

/// A box that spins at 10⁵ rad/s takes about 10⁵ steps a second.
struct FastBox {
  FastBox() : system(MakeModel("falling_box", {})), x(system->nominal().x) {
    x(2) = 1000;
    x.tail(3) << 1e5, 0.7e5, 0.4e5;
    options.max_steps = 1000000000;
    options.max_seconds = 1000;
    options.max_megabytes = 1e9;
    options.dense = false;
  }
  Trajectory Run(double duration) const {
    return Simulate(*system, x, system->nominal().u, duration, options);
  }
  const std::unique_ptr<MechanicalSystem> system;
  Vector x;
  SimulateOptions options;
};

TEST(Budget, IsNoneWithoutAScope) {
  EXPECT_FALSE(HasBudget());
  EXPECT_NO_THROW(AskBudget());
  EXPECT_NO_THROW(AskMemory(1e300, "everything"));
}

TEST(Budget, StaysUsedUp) {
  const Ended ended = RunWithin(test::Seconds(0.01), [] {
    EXPECT_THROW(for (;;) AskBudget(), BudgetExceeded);
    for (int again = 0; again < 3; ++again) EXPECT_THROW(AskBudget(), BudgetExceeded);
  });
  EXPECT_LT(ended.seconds, 0.01 + test::kPromise);
}

TEST(Budget, ThatIsInnermostCounts) {
  RunWithin(test::Seconds(0), [] {
    RunWithin(test::Seconds(1e6), [] { EXPECT_NO_THROW(AskBudget()); });
    EXPECT_THROW(AskBudget(), BudgetExceeded);
  });
  EXPECT_FALSE(HasBudget());
}

TEST(Budget, NamesStagesAndFigures) {
  const Ended time = RunWithin(test::Seconds(0), [] {
    const BudgetStage outer("the answer");
    BudgetStage inner("the arcs", 12);
    inner.Next();
    AskBudget();
  });
  EXPECT_EQ(time.message,
            "max_seconds = 0 are used up; options.max_seconds may be raised; it ended in: the "
            "answer, the arcs (1 of 12 done)");
  const Ended memory = RunWithin(test::Megabytes(10), [] {
    AskMemory(9.9e6, "a small thing");
    AskMemory(2.5e7, "its matrices");
  });
  EXPECT_EQ(memory.end, BudgetEnd::kMegabytes);
  EXPECT_EQ(memory.message,
            "max_megabytes = 10 do not hold its matrices, which take 25 MB; "
            "options.max_megabytes may be raised");
}

TEST(Budget, AskedForeverByManyThreadsIsCancelledOnceForAll) {
  const Budget budget;
  std::vector<std::thread> threads;
  std::vector<Ended> ended(4);
  for (Ended& end : ended) {
    threads.emplace_back([&end, &budget] {
      end = RunWithin(budget, [] {
        for (;;) AskBudget();
      });
    });
  }
  budget.Cancel("first");
  budget.Cancel("second");
  for (std::thread& thread : threads) thread.join();
  for (const Ended& end : ended) EXPECT_EQ(end.message, "first");
}

TEST(Budget, EndsASimulationWithAStatusAndWhatThereIs) {
  const FastBox box;
  Trajectory run;
  const Ended ended = RunWithin(test::Seconds(0.2), [&] { run = box.Run(10); });
  EXPECT_EQ(ended.end, BudgetEnd::kNone) << "a simulation has a status";
  EXPECT_LT(ended.seconds, 0.2 + test::kPromise);
  EXPECT_EQ(run.status.outcome, Outcome::kBudgetExceeded);
  for (const char* part : {"max_seconds = 0.2", "may be raised", "stopped at t = "}) {
    EXPECT_NE(run.status.message.find(part), std::string::npos) << run.status.message;
  }
  EXPECT_GT(run.t_end(), 0);
  EXPECT_LT(run.t_end(), 10);
  EXPECT_TRUE(run.FinalState().allFinite());
}

TEST(Budget, OfProcessorTimeEndsARunWhoseStepsAreDear) {
  FastBox box;
  box.options.max_seconds = 0.01;
  box.options.cancelled = [] {  // asked at every step, which takes 5 ms so
    const double begin = ThreadSeconds();
    while (ThreadSeconds() < begin + 5e-3) {
    }
    return false;
  };
  const Trajectory run = box.Run(10);
  EXPECT_EQ(run.status.outcome, Outcome::kBudgetExceeded);
  EXPECT_NE(run.status.message.find("processor time"), std::string::npos) << run.status.message;
  EXPECT_LE(run.statistics.steps + run.statistics.rejected_steps, 24) << "looks are 8 steps apart";
}

TEST(Budget, CancelledSimulationSaysSo) {
  const FastBox box;
  const Budget budget;
  budget.Cancel("nobody waits");
  Trajectory run;
  RunWithin(budget, [&] { run = box.Run(10); });
  EXPECT_EQ(run.status.outcome, Outcome::kCancelled);
  EXPECT_EQ(run.status.message.find("nobody waits"), 0u) << run.status.message;
}

TEST(Budget, ChangesNoBit) {
  const FastBox box;
  const Trajectory free = box.Run(0.01);
  Trajectory within;
  RunWithin(test::Seconds(1000), [&] { within = box.Run(0.01); });
  EXPECT_TRUE(within.status.ok());
  EXPECT_EQ(free.FinalState(), within.FinalState());
  EXPECT_EQ(free.statistics.field_evaluations, within.statistics.field_evaluations);
}

TEST(Budget, OfMemoryBoundsADenseRun) {
  FastBox box;
  box.options.dense = true;
  box.options.max_megabytes = 2;  // 13 numbers, 8 coefficients: 848 bytes a step
  const Trajectory run = box.Run(10);
  EXPECT_EQ(run.status.outcome, Outcome::kBudgetExceeded);
  EXPECT_NE(run.status.message.find("max_megabytes = 2 "), std::string::npos) << run.status.message;
  std::size_t steps = 0;
  for (const Arc& arc : run.arcs) steps += arc.dense.NumSteps();
  EXPECT_LE(848 * steps, 2e6);
  EXPECT_GE(848 * steps, 1.5e6) << "most of it is steps";
}

TEST(Names, AreCutInMessages) {
  EXPECT_EQ(QuoteName("left_foot"), "'left_foot'");
  const std::string quoted = QuoteName(std::string(100000000, 'x'));
  EXPECT_EQ(quoted, "'" + std::string(60, 'x') + "… (100000000 bytes)'");
  EXPECT_LT(UnknownName("model", std::string(1000000, 'y'), {"a", "b"}).size(), 200u);
  // 59 bytes, and a character of two bytes across the border: not cut in the middle.
  EXPECT_EQ(Cut(std::string(59, 'x') + "ää", 60), std::string(59, 'x') + "… (63 bytes)");
}

}  // namespace
}  // namespace contact_flow
