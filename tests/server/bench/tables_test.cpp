#include "server/bench/tables.h"

#include <gtest/gtest.h>

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
  const Fields row{{"session", "box, \"open\""}, {"value", Number{1, 0}}, {"base", true}};
  CsvFile table(path, row);
  EXPECT_EQ(text_of(path), "session,value,base\n");
  table.add(row);
  EXPECT_EQ(text_of(path), "session,value,base\n\"box, \"\"open\"\"\",1,1\n");
  std::filesystem::remove(path);
  EXPECT_THROW(CsvFile("/nowhere/table.csv", row), capture::InputError);
}

TEST(BenchTables, WhatIsNotThereIsEmpty) {
  BenchRow row{"tabletop", "dvct", "live-64", "none", {}, {}};
  row.run.measures.relight_error = 0.123456;
  row.run.measures.object_error = std::nan("");
  row.run.measures.psnr_db = INFINITY;
  row.run.moving.host = {.wall_ms = 20, .cpu_ms = 33.25};
  row.run.still.gpu_ms = 0.5;
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "lumigraft-bench-missing.csv";
  CsvFile(path, fields_of(row)).add(fields_of(row));
  EXPECT_EQ(text_of(path),
            "session,method,setting,oracle,relight_error,object_error,psnr,psnr_affected,psnr_object,psnr_relit,flip,"
            "cpu_ms,wall_ms,gpu_ms,still_cpu_ms,still_wall_ms,still_gpu_ms\n"
            "tabletop,dvct,live-64,none,0.1235,,,0.00,0.00,0.00,0.0000,33.2,20.0,,0.0,0.0,0.500\n");
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace lumigraft::server
