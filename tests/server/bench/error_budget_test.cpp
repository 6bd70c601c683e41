#include "server/bench/error_budget.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace lumigraft::server {
namespace {

TEST(BenchBudget, OnePartIsEstimatedAtATime) {
  std::vector<std::string> cases;
  for (const BudgetCase& budget : budget_cases()) {
    cases.push_back(budget.estimated + " | " + name_of(budget.oracle));
  }
  EXPECT_EQ(cases, (std::vector<std::string>{"nothing | pose+geometry+light+albedo", "pose | geometry+light+albedo",
                                             "geometry | pose+light+albedo", "light | pose+geometry+albedo",
                                             "albedo | pose+geometry+light", "everything | none"}));
}

TEST(BenchBudget, WithoutErrorsThereIsNoChart) {
  const std::filesystem::path stem = std::filesystem::path(testing::TempDir()) / "lumigraft-error-budget";
  BenchResults results;
  draw_error_budget(results, stem);
  EXPECT_FALSE(std::filesystem::exists(stem.string() + ".png"));
  results.budget = {{"a", "nothing", 0.1, 0.1}, {"a", "everything", 0.2, 0.1}};
  draw_error_budget(results, stem);
  EXPECT_TRUE(std::filesystem::exists(stem.string() + ".png"));
  std::filesystem::remove(stem.string() + ".png");
  std::filesystem::remove(stem.string() + ".svg");
}

}  // namespace
}  // namespace lumigraft::server
