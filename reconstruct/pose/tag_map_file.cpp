#include "reconstruct/pose/tag_map_file.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "capture/message_text.h"
#include "capture/session/config.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using capture::ConfigTable;
using capture::formatted;
using Eigen::Isometry3d;
using Step = Eigen::Matrix<double, 6, 1>;
using Rows4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

constexpr int kFormat = 1;
constexpr const char* kPlaceKey = "T_world_tag";
constexpr const char* kHeldKey = "T_world_tag_held";
constexpr const char* kConfiguredKey = "T_tag_extra";

double size_of(const capture::Tag& tag, std::size_t index) {
  return index == 0 ? tag.size_m : tag.extra[index - 1].size_m;
}

std::string array_text(std::span<const double> values) {
  std::string text;
  for (const double value : values) text += formatted("%s%.17g", text.empty() ? "[" : ", ", value);
  return text + "]";
}

std::string pose_text(const char* key, const std::optional<Isometry3d>& pose) {
  if (!pose) return {};
  const Rows4 rows = pose->matrix();
  std::string text = std::string(key) + " = [";
  for (std::size_t r = 0; r < 4; ++r) text += (r > 0 ? ", " : "") + array_text(std::span(rows.data() + 4 * r, 4));
  return text + "]\n";
}

/// Empty if the table does not have the key.
std::optional<Isometry3d> read_pose(const ConfigTable& table, const char* key) {
  if (!table.has(key)) return std::nullopt;
  const std::vector<double> numbers = table.rigid_transform(key);
  const Eigen::Map<const Rows4> rows(numbers.data());
  Isometry3d pose = Isometry3d::Identity();
  // A matrix edited by hand is orthonormal to few digits.
  pose.linear() = Eigen::Quaterniond(Eigen::Matrix3d(rows.topLeftCorner<3, 3>())).normalized().toRotationMatrix();
  pose.translation() = rows.topRightCorner<3, 1>();
  return pose;
}

bool same_pose(const std::optional<Isometry3d>& a, const std::optional<Isometry3d>& b) {
  return a && b ? a->isApprox(*b, kTagMapFile.same_number) : a.has_value() == b.has_value();
}

PoseCovariance read_covariance(const ConfigTable& table) {
  const std::vector<double> numbers = table.numbers("covariance", 36);
  const PoseCovariance covariance = Eigen::Map<const PoseCovariance>(numbers.data());
  const Eigen::SelfAdjointEigenSolver<PoseCovariance> solver(covariance, Eigen::EigenvaluesOnly);
  const double largest = covariance.cwiseAbs().maxCoeff(), tolerance = kTagMapFile.same_number * largest;
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > tolerance ||
      solver.eigenvalues().minCoeff() < -tolerance)
    table.fail("covariance", "found a matrix that is no covariance, allowed: symmetric and positive");
  return (covariance + covariance.transpose()) / 2;
}

/// Index of the tag with this id in the configuration.
std::size_t index_of(const ConfigTable& table, const char* key, int id, const TagMap::State& state) {
  const auto found = std::ranges::find(state.tags, id, &TagMap::Tag::id);
  if (found == state.tags.end())
    table.fail(key, formatted("found %d, allowed: a tag of the configuration, this map is of other tags", id));
  return static_cast<std::size_t>(found - state.tags.begin());
}

void read_one_tag(const ConfigTable& table, const capture::Tag& configuration, TagMap::State& state) {
  const std::size_t index = index_of(table, "id", table.integer("id", 0, kTagMapFile.max_id), state);
  TagMap::Tag& tag = state.tags[index];
  const double size_m = size_of(configuration, index);
  if (std::abs(table.number("size_m", 0, HUGE_VAL) - size_m) > kTagMapFile.same_number * size_m)
    table.fail("size_m", formatted("found another size than the configuration's, allowed: %g", size_m));
  if (!same_pose(read_pose(table, kConfiguredKey), tag.configured))
    table.fail(kConfiguredKey, formatted("found another pose of tag %d than the configuration's, allowed: the same, "
                                         "since it was learnt with it",
                                         tag.id));
  tag.T_world_tag = read_pose(table, kPlaceKey);
  tag.held = read_pose(table, kHeldKey);
  if (index == 0 && !tag.T_world_tag)
    table.fail(kPlaceKey, "found nothing, allowed: the first tag's pose, which is always known");
  tag.covariance = read_covariance(table);
  tag.moved_m = table.number("moved_m", 0, HUGE_VAL);
  tag.seen_from_others = tag.T_world_tag.has_value();
}

void read_one_pair(const ConfigTable& table, TagMap::State& state) {
  const std::vector<double> ids = table.numbers("tags", 2);
  std::pair<std::size_t, std::size_t> ab;
  ab.first = index_of(table, "tags", static_cast<int>(std::clamp(ids[0], -1.0, 1.0 * kTagMapFile.max_id)), state);
  ab.second = index_of(table, "tags", static_cast<int>(std::clamp(ids[1], -1.0, 1.0 * kTagMapFile.max_id)), state);
  if (ab.first >= ab.second || state.pairs.contains(ab))
    table.fail("tags", "found a pair in another order than the configuration's or twice, allowed: each once");
  TagMap::Pair pair;
  pair.count = table.integer("sightings", 1, kTagMap.max_sightings);
  const std::optional<Isometry3d> mean = read_pose(table, "T_a_b");
  if (!mean) table.fail("T_a_b", "found nothing, allowed: the second tag's pose in the first one's frame");
  pair.mean = *mean;
  const std::vector<double> squares = table.numbers("squared_deviations", 6);
  pair.squares = Eigen::Map<const Step>(squares.data());
  if (pair.squares.minCoeff() < 0)
    table.fail("squared_deviations", "found a negative number, allowed: six that are not");
  pair.optimized = pair.known() ? pair.count : 0;
  state.pairs[ab] = pair;
}

}  // namespace

std::string tag_map_text(const capture::Tag& tag, const TagMap::State& state) {
  std::string text = formatted(
      "# Where the tags are, as learnt by lumigraft serve. Delete this file to have them learnt anew.\n"
      "format = %d\nfamily = \"%s\"\n# how many follow: a file that was cut short is recognized\ntags = %zu\npairs = "
      "%zu\n",
      kFormat, tag.family.c_str(), state.tags.size(), state.pairs.size());
  for (std::size_t t = 0; t < state.tags.size(); ++t) {
    const TagMap::Tag& known = state.tags[t];
    text +=
        formatted("\n[[tag]]\nid = %d\nsize_m = %.17g\nmoved_m = %.17g\n", known.id, size_of(tag, t), known.moved_m);
    text += pose_text(kConfiguredKey, known.configured) + pose_text(kPlaceKey, known.T_world_tag) +
            pose_text(kHeldKey, known.held) + "covariance = " + array_text(std::span(known.covariance.data(), 36)) +
            "\n";
  }
  for (const auto& [ab, pair] : state.pairs) {
    text += formatted("\n[[pair]]\ntags = [%d, %d]\nsightings = %d\n", state.tags[ab.first].id,
                      state.tags[ab.second].id, pair.count);
    text +=
        pose_text("T_a_b", pair.mean) + "squared_deviations = " + array_text(std::span(pair.squares.data(), 6)) + "\n";
  }
  return text;
}

TagMap::State read_tag_map(const std::filesystem::path& file, const capture::Tag& tag) {
  const ConfigTable root = ConfigTable::load(file);
  root.integer("format", kFormat, kFormat);
  if (const std::string family = root.text("family"); family != tag.family)
    root.fail("family", "found \"" + family + "\", allowed: \"" + tag.family + "\", this map is of other tags");
  TagMap::State state = TagMap(tag).state();
  const std::vector<ConfigTable> tags = root.tables("tag"), pairs = root.tables("pair");
  for (const auto& [key, found] : {std::pair("tags", tags.size()), std::pair("pairs", pairs.size())})
    if (const int stated = root.integer(key, 0, kTagMapFile.max_tables); stated != static_cast<int>(found))
      root.fail(key,
                formatted("found %d and then %zu, allowed: as many as follow, the file is incomplete", stated, found));
  std::vector<bool> seen(state.tags.size());
  for (const ConfigTable& table : tags) {
    read_one_tag(table, tag, state);
    const std::size_t index = index_of(table, "id", table.integer("id", 0, kTagMapFile.max_id), state);
    if (seen[index]) table.fail("id", "found it twice, allowed: each tag once");
    seen[index] = true;
  }
  if (!seen[0]) root.fail("tag", formatted("found no tag %d, allowed: the configuration's first tag", tag.id));
  for (const ConfigTable& table : pairs) read_one_pair(table, state);
  root.finish();
  return state;
}

}  // namespace lumigraft::reconstruct
