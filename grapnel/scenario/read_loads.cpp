#include "grapnel/scenario/read_loads.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Rows [t, Fx, Fy, Fz, Mx, My, Mz]. What is no such row has been reported.
void read_table(const Node& list, const std::string& path, LoadProfile& profile, FaultList& faults) {
  for (std::size_t i = 0; i < list.items.size() && !faults.full(); ++i) {
    std::vector<double> row;
    for (const Node& entry : list.items[i].items) row.push_back(number_of(entry).value_or(0));
    if (row.size() != 7 || !std::isfinite(row[0])) continue;
    if (!profile.times.empty() && !(row[0] > profile.times.back())) {
      faults.add(list.items[i].items[0].mark, fmt::format("{}: time {} must be greater than {} of the row before",
                                                          item(path, i), row[0], profile.times.back()));
    }
    profile.times.push_back(row[0]);
    profile.values.push_back({{row[4], row[5], row[6]}, {row[1], row[2], row[3]}});
  }
}

LoadSetup read_wrench(const Node& node, const std::string& path, Reading& reading) {
  LoadSetup load;
  const std::string body = text_at(node, "body"), target = text_at(node, "target");
  reading.robot.links.expect(body, part(node, "body").mark, path, reading.faults);
  reading.targets.expect(target, part(node, "target").mark, path, reading.faults);
  load.body = node.find("target") ? target_body_name(target) : body;
  read_members(node, "external_wrenches", &load);
  load.in_body = text_at(node, "frame") == "body";
  if (load.profile.shape == LoadProfile::Shape::table) {
    const std::string table = below(below(path, "time"), "values");
    read_table(part(part(node, "time"), "values"), table, load.profile, reading.faults);
    for (const char* key : {"force", "torque"}) {
      if (const NodeEntry* entry = node.entry(key)) {
        reading.faults.add(entry->mark, fmt::format("'{}' in {} has no meaning with time.shape: table: its values are "
                                                    "the wrench itself",
                                                    key, path));
      }
    }
  }
  return load;
}

// The model's name of a link, the base or a target; a fault if there is none.
std::string body_named(const Node& node, const std::string& path, Reading& reading) {
  if (!is_text(node) || node.text.empty()) return {};
  const NameTable &links = reading.robot.links, &targets = reading.targets;
  if (links.contains(node.text)) return node.text;
  if (targets.contains(node.text)) return target_body_name(node.text);
  if (links.complete() && targets.complete()) {
    std::vector<std::string> names = links.names();
    names.insert(names.end(), targets.names().begin(), targets.names().end());
    reading.faults.add(node.mark, fmt::format("unknown body {} in {}{}", in_quotes(node.text), path,
                                              suggestion(node.text, names, "bodies")));
  }
  return {};
}

}  // namespace

void read_external_wrenches(Reading& reading) {
  const Node& list = part(reading.root, "external_wrenches");
  for (std::size_t i = 0; i < list.items.size() && !reading.faults.full(); ++i) {
    reading.problem.loads.push_back(read_wrench(list.items[i], item("external_wrenches", i), reading));
  }
}

void read_clearance(Reading& reading) {
  const Node& node = part(reading.root, "clearance");
  ClearanceSetup& clearance = reading.problem.clearance;
  read_members(node, "clearance", &clearance);
  const Node& pairs = part(node, "ignore");
  for (std::size_t i = 0; i < pairs.items.size() && !reading.faults.full(); ++i) {
    const Node& pair = pairs.items[i];
    if (pair.items.size() != 2) continue;
    const std::string path = item("clearance.ignore", i);
    const std::string first = body_named(pair.items[0], path, reading);
    const std::string second = body_named(pair.items[1], path, reading);
    if (first.empty() || second.empty()) continue;
    if (first == second) {
      reading.faults.add(pair.items[1].mark, fmt::format("{} names {} twice", path, in_quotes(pair.items[1].text)));
    }
    clearance.ignore.emplace_back(first, second);
  }
}

}  // namespace grapnel
