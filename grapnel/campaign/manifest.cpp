#include "grapnel/campaign/manifest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "grapnel-campaign-folder/2";
constexpr const char* kChecksum = "checksum";  // of the document without this key, as json_text() writes it

std::filesystem::path path_in(const std::filesystem::path& folder) { return folder / "manifest.json"; }

// --- To JSON ---

template <class T>
Json heads_json(const std::vector<T>& heads) {
  Json list = Json::array();
  for (const T& head : heads)
    list.push_back({{"name", head.name}, {"unit", head.unit}, {"description", head.description}});
  return list;
}

Json design_json(const std::vector<StudyAxis>& axes) {
  Json list = Json::array();
  for (const StudyAxis& axis : axes) {
    Json values = Json::array();
    for (const AxisValue& value : axis.values)
      values.push_back(axis.is_numeric ? Json(value.number) : Json(value.label));
    list.push_back({{"name", axis.name},
                    {"unit", axis.unit},
                    {"description", axis.description},
                    {"numeric", axis.is_numeric},
                    {"values", values}});
  }
  return list;
}

Json document_of(const Manifest& manifest) {
  const Campaign& c = manifest.campaign;
  Json success = Json::array();
  for (const Criterion& criterion : c.success)
    success.push_back({{"name", criterion.name()}, {"holds", criterion.text()}});
  return {{"schema", kSchema},
          {"version", manifest.version},
          {"campaign", c.name},
          {"description", c.description},
          {"sha256", c.sha256},
          {"seed", c.seed},
          {"sampling", name_of(c.sampling)},
          {"simulate", name_of(c.mode)},
          {"plan", name_of(c.plan)},
          {"cases", c.cases},
          {"total", manifest.total},
          {"added", manifest.added},
          {"block_size", manifest.block_size},
          {"arithmetic", manifest.arithmetic},
          {"time_limit", c.time_limit},
          {"inputs", heads_json(c.inputs)},
          {"columns", heads_json(c.columns)},
          {"design", design_json(c.design)},
          {"success", success},
          {"confidence", c.confidence},
          {"quantiles", c.quantiles},
          {"series",
           {{"sample", c.series.sample},
            {"failures", c.series.failures},
            {"worst", c.series.worst},
            {"worst_by", c.series.worst_by}}},
          {"file", c.file},
          {"file_folder", manifest.file_folder},
          {"text", c.text}};
}

// --- From JSON; exceptions of nlohmann::json name missing keys and wrong types ---

template <class T>
std::vector<T> heads_from(const Json& list) {
  std::vector<T> heads;
  for (const Json& entry : list) {
    T head;
    head.name = entry.at("name").get<std::string>();
    head.unit = entry.at("unit").get<std::string>();
    head.description = entry.at("description").get<std::string>();
    heads.push_back(std::move(head));
  }
  return heads;
}

std::vector<StudyAxis> design_from(const Json& list) {
  std::vector<StudyAxis> axes;
  for (const Json& entry : list) {
    StudyAxis axis{entry.at("name").get<std::string>(),
                   entry.at("unit").get<std::string>(),
                   entry.at("description").get<std::string>(),
                   entry.at("numeric").get<bool>(),
                   {}};
    for (const Json& value : entry.at("values"))
      axis.values.push_back(axis.is_numeric ? AxisValue{value.get<double>(), ""}
                                            : AxisValue{NAN, value.get<std::string>()});
    axes.push_back(std::move(axis));
  }
  return axes;
}

template <class Enum>
Enum choice_at(const Json& document, const char* key) {
  const std::string name = document.at(key).get<std::string>();
  if (const auto value = value_named<Enum>(name)) return *value;
  throw std::runtime_error(fmt::format("{} '{}' is unknown", key, name));
}

Manifest manifest_from(const Json& document) {
  Manifest manifest;
  Campaign& c = manifest.campaign;
  manifest.version = document.at("version").get<std::string>();
  manifest.total = document.at("total").get<std::uint64_t>();
  manifest.added = document.at("added").get<std::vector<std::uint64_t>>();
  manifest.block_size = document.at("block_size").get<std::uint64_t>();
  if (manifest.block_size == 0) throw std::runtime_error("block_size is 0");
  if (manifest.total > kMostCases) throw std::runtime_error(fmt::format("total is {}", manifest.total));
  manifest.arithmetic = document.at("arithmetic").get<std::string>();
  c.name = document.at("campaign").get<std::string>();
  c.description = document.at("description").get<std::string>();
  c.sha256 = document.at("sha256").get<std::string>();
  c.seed = document.at("seed").get<std::uint64_t>();
  c.sampling = choice_at<Sampling>(document, "sampling");
  c.mode = choice_at<StudyMode>(document, "simulate");
  c.plan = choice_at<CampaignPlan>(document, "plan");
  c.cases = document.at("cases").get<std::uint64_t>();
  c.time_limit = document.at("time_limit").get<double>();
  c.inputs = heads_from<CampaignInput>(document.at("inputs"));
  c.columns = heads_from<Column>(document.at("columns"));
  c.design = design_from(document.at("design"));
  c.series.sample = document.at("series").at("sample").get<std::uint64_t>();
  c.series.failures = document.at("series").at("failures").get<std::uint64_t>();
  c.series.worst = document.at("series").at("worst").get<std::uint64_t>();
  c.series.worst_by = document.at("series").at("worst_by").get<std::string>();
  c.file = document.at("file").get<std::string>();
  manifest.file_folder = document.value("file_folder", "");
  c.text = document.at("text").get<std::string>();
  std::vector<std::string> names;
  for (const Column& column : c.columns) names.push_back(column.name);
  for (const CampaignInput& input : c.inputs) names.push_back(input.name);
  for (const Json& entry : document.at("success"))
    c.success.push_back(
        Criterion::parse(entry.at("holds").get<std::string>(), names, entry.at("name").get<std::string>()));
  c.confidence = document.at("confidence").get<double>();
  c.quantiles = document.at("quantiles").get<std::vector<double>>();
  return manifest;
}

// Detects changes since it was written. Removes the checksum from the document.
void expect_checksum(Json& document, const std::filesystem::path& path) {
  const auto found = document.find(kChecksum);
  if (found == document.end() || !found->is_string())
    throw std::runtime_error(path.string() + ": damaged: it has no checksum");
  const std::string stated = found->get<std::string>();
  document.erase(kChecksum);
  if (checksum_text(json_text(document)) != stated)
    throw std::runtime_error(path.string() + ": damaged: its contents were changed, the checksum does not match");
}

std::string damaged(const std::filesystem::path& path, const std::string& fault) {
  return fault + "\nmove this file to another folder: the command that created " + path.parent_path().string() +
         " then creates it again and keeps all valid rows; repeat --extend for cases that were added";
}

// --- Differences ---

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

// The first difference of two texts.
std::string first_difference(const std::string& was, const std::string& is) {
  const std::vector<std::string> a = lines_of(was), b = lines_of(is);
  std::size_t line = 0;
  while (line < a.size() && line < b.size() && a[line] == b[line]) ++line;
  const auto quoted = [&](const std::vector<std::string>& lines) {
    return line < lines.size() ? "'" + lines[line] + "'" : std::string("absent");
  };
  return fmt::format("line {} of its file is {}, not {}", line + 1, quoted(a), quoted(b));
}

template <class T>
std::string names_of(const std::vector<T>& heads) {
  std::string all;
  for (const T& head : heads) all += head.name + '\n';
  return all;
}

}  // namespace

std::uint64_t block_size_for(std::uint64_t total) {
  // Cases of a block share up to eight lanes: small campaigns use full lanes if there are enough blocks for all
  // processors.
  constexpr std::uint64_t kLeastBlocks = 256, kLargest = 500, kFewestBlocks = 64, kLanes = 8;
  const std::uint64_t full = std::min(kLanes, total / kFewestBlocks);
  return std::clamp<std::uint64_t>(std::max(full, total / kLeastBlocks), 1, kLargest);
}

std::string arithmetic_here() {
  const std::optional<lanes::InstructionSet> set = lanes::best_instruction_set();
  if (!set) return "double";
  return *set == lanes::InstructionSet::sse2 ? "sse2" : "fma";
}

Manifest new_manifest(const Campaign& campaign, const std::string& version, const std::string& arithmetic) {
  Manifest manifest{version, campaign, campaign.total(), block_size_for(campaign.total()), {}, arithmetic};
  manifest.campaign.draw = nullptr;
  manifest.campaign.problem = nullptr;
  manifest.campaign.scenario_text = nullptr;
  for (Column& column : manifest.campaign.columns) column.value = nullptr;
  return manifest;
}

void write_manifest(const std::filesystem::path& folder, const Manifest& manifest) {
  Json document = document_of(manifest);
  document[kChecksum] = checksum_text(json_text(document));
  write_file_atomically(path_in(folder), json_text(document));
}

std::optional<Manifest> read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path path = path_in(folder);
  std::error_code none;
  if (!std::filesystem::exists(path, none)) return std::nullopt;
  file_bytes(path);  // throws if it cannot be read
  try {
    Json document = read_json_document(path, kSchema);
    expect_checksum(document, path);
    return manifest_from(document);
  } catch (const Json::exception& error) {
    const std::string what = error.what();  // "[json.exception.out_of_range.403] key 'x' not found"
    const std::size_t at = what.find("] ");
    throw DamagedManifest(
        damaged(path, path.string() + ": damaged: " + (at == std::string::npos ? what : what.substr(at + 2))));
  } catch (const std::exception& error) {
    const std::string what = error.what();
    throw DamagedManifest(damaged(path, what.starts_with(path.string()) ? what : path.string() + ": damaged: " + what));
  }
}

std::vector<std::string> differences(const Manifest& manifest, const Campaign& campaign, const std::string& version,
                                     const std::string& arithmetic) {
  const Campaign& there = manifest.campaign;
  std::vector<std::string> lines;
  const auto compare = [&](const char* what, const auto& was, const auto& is) {
    if (was != is) lines.push_back(fmt::format("its {} is {}, not {}", what, was, is));
  };
  if (manifest.version != version)
    lines.push_back(
        fmt::format("it was created by grapnel {}, and this is {}: their rows may differ", manifest.version, version));
  if (manifest.arithmetic != arithmetic)
    lines.push_back(fmt::format("its rows have the arithmetic '{}', not '{}': they differ in the last bits",
                                manifest.arithmetic, arithmetic));
  compare("name", "'" + there.name + "'", "'" + campaign.name + "'");
  compare("seed", there.seed, campaign.seed);
  compare("sampling", name_of(there.sampling), name_of(campaign.sampling));
  compare("mode", name_of(there.mode), name_of(campaign.mode));
  compare("number of inputs", there.inputs.size(), campaign.inputs.size());
  compare("number of columns", there.columns.size(), campaign.columns.size());
  if (there.sha256 == campaign.sha256) {
    if (lines.empty() && names_of(there.inputs) != names_of(campaign.inputs)) lines.push_back("its inputs differ");
    if (lines.empty() && names_of(there.columns) != names_of(campaign.columns)) lines.push_back("its columns differ");
    return lines;
  }
  lines.push_back(there.text == campaign.text ? "its scenario, or a file that the scenario names, has changed"
                                              : first_difference(there.text, campaign.text));
  return lines;
}

}  // namespace grapnel
