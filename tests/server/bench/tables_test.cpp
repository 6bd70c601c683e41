#include "server/bench/tables.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "capture/error.h"

namespace lumigraft::server {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(BenchTables, ATableIsCompleteAfterEveryRow) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "lumigraft-bench-table.csv";
  CsvFile table(path, {"session", "value"});
  EXPECT_EQ(text_of(path), "session,value\n");
  table.add({"box, \"open\"", "1"});
  EXPECT_EQ(text_of(path), "session,value\n\"box, \"\"open\"\"\",1\n");
  std::filesystem::remove(path);
  EXPECT_THROW(CsvFile("/nowhere/table.csv", {"session"}), capture::InputError);
}

TEST(BenchTables, WhatIsNotThereIsEmpty) {
  BenchRow row{"tabletop", "dvct", "live-64", "none", {}, {}};
  row.run.measures.relight_error = 0.123456;
  row.run.measures.object_error = std::nan("");
  row.run.measures.psnr_db = INFINITY;
  row.run.moving.host = {.wall_ms = 20, .cpu_ms = 33.25};
  row.run.still.gpu_ms = 0.5;
  const std::vector<std::string> columns = result_columns(), cells = result_cells(row);
  ASSERT_EQ(columns.size(), cells.size());
  const auto cell = [&](const std::string& column) {
    return cells[static_cast<std::size_t>(std::find(columns.begin(), columns.end(), column) - columns.begin())];
  };
  EXPECT_EQ(cell("setting"), "live-64");
  EXPECT_EQ(cell("relight_error"), "0.1235");
  EXPECT_EQ(cell("object_error"), "");
  EXPECT_EQ(cell("psnr"), "");
  EXPECT_EQ(cell("cpu_ms"), "33.2");
  EXPECT_EQ(cell("wall_ms"), "20.0");
  EXPECT_EQ(cell("gpu_ms"), "");
  EXPECT_EQ(cell("still_gpu_ms"), "0.500");
  EXPECT_EQ(work_columns().size(), work_cells({"pixels", 76800, true, {}}).size());
  EXPECT_EQ(stage_cells("tabletop", "pose", {.wall_ms = 7, .cpu_ms = 6.25}),
            (std::vector<std::string>{"tabletop", "pose", "6.2", "7.0"}));
  EXPECT_EQ(budget_columns().size(), budget_cells({"tabletop", "pose", 0.1, 0.2}).size());
}

}  // namespace
}  // namespace lumigraft::server
