#include "grapnel/compare/log_mapping.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {

template <>
struct Described<SearchedOffset> : Enumeration<SearchedOffset, "SearchedOffset", "found"> {};
template <>
struct Described<SearchedDrift> : Enumeration<SearchedDrift, "SearchedDrift", "found"> {};
template <>
struct Described<QuaternionOrder> : Enumeration<QuaternionOrder, "QuaternionOrder", "wxyz", "xyzw"> {};

template <>
struct Described<MappedTime> {
  using T = MappedTime;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::column>("column",
                        "Column or dataset with the times of the samples. They must not decrease. Of messages a field "
                        "of the same message, such as `header.stamp`, `log_time` or `publish_time`. Absent: `time`, "
                        "else `log_time` of messages.")
          .optional(),
      field<&T::unit>("unit", "Unit of these times, such as `ms`. Absent: the unit that the log states, else s.")
          .optional(),
      field<&T::offset>("offset", "s",
                        "Time of the run minus time of the log. found: the offset with the smallest weighted "
                        "residuals.")
          .called("a number; the word found")
          .up_to(1e11),
      field<&T::search>("search", "s",
                        "First and last offset that are searched. Absent: all for which half of the shorter record "
                        "overlaps the other.")
          .up_to(1e11)
          .optional(),
      field<&T::drift>(
          "drift", "1",
          "Rate of the run's time per time of the log, minus 1: `5e-5` is 50 ppm, the log's clock is slow. "
          "found: fitted together with the offset.")
          .called("a number; the word found")
          .up_to(0.1),
      field<&T::largest_drift>("largest_drift", "1", "Largest magnitude of a drift that is searched.")
          .above(0)
          .up_to(0.1),
      field<&T::reference>("reference", "s",
                           "Time of the log at which a drifting clock has the offset. Absent: the first time of the "
                           "log.")
          .up_to(1e11)
          .optional(),
      field<&T::from>("from", "s", "Samples before this time of the run are not compared. Absent: all are.").optional(),
      field<&T::to>("to", "s", "Samples after this time of the run are not compared. Absent: all are.").optional(),
  });
  static constexpr Type type = structure<T>("log_time", "The clock of the log.", fields);
};

template <>
struct Described<MappedQuantity> {
  using T = MappedQuantity;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::run>("run",
                     "A series of the run, such as `base/angular_velocity`, or one of its components: "
                     "`base/angular_velocity/z`.")
          .required(),
      field<&T::log>("log",
                     "Columns or datasets of the log, one for each component, or a dataset with all components. "
                     "`NAME[2]` is a column of a dataset, counted from 0.")
          .called("the name of a column; a list of columns")
          .items(1, 64)
          .required(),
      field<&T::name>("name", "Name in results. Absent: the series of the run.").optional(),
      field<&T::time>("time", "Times of these samples, where they have a column besides `time.column`.").optional(),
      field<&T::unit>("unit",
                      "Unit of the numbers in the log, such as `deg/s`. Absent: the unit that the log states, else "
                      "that of the run.")
          .optional(),
      field<&T::scale>("scale", "1", "Factor on the numbers in the log."),
      field<&T::frame>("frame",
                       "The body in whose axes the log states a vector, such as `base` or `targets/debris`. Absent: "
                       "the world frame.")
          .optional(),
      field<&T::axes>("quaternion_wxyz", "1",
                      "Orientation of the log's axes in that frame, for vectors and orientations."),
      field<&T::origin>("origin", "m",
                        "Origin of the log's axes in that frame, for positions. With `frame` positions are then "
                        "relative to this body; `[0, 0, 0]` is its origin. Absent: the origin of the world.")
          .optional(),
      field<&T::marker>("marker", "m",
                        "Position of a marker in the body's axes, from its origin, for the position of a body: the log "
                        "has the marker's position. Absent: the body's origin.")
          .optional(),
      field<&T::quaternion_order>("quaternion_order", "Order of a quaternion's components in the log."),
      field<&T::average>("average", "s",
                         "The sensor averages over this time before each time stamp. Absent: it takes samples.")
          .at_least(0),
      field<&T::uncertainty>("uncertainty",
                             "Standard uncertainty of each sample and component, with its unit or in `unit`; for "
                             "orientations an angle. Absent: no verdict.")
          .in_any_unit()
          .above(0)
          .optional(),
      field<&T::bias_uncertainty>("bias_uncertainty",
                                  "Standard uncertainty of an error that all samples of a component share. Absent: "
                                  "the bias is part of the residuals and is not tested separately.")
          .in_any_unit()
          .at_least(0)
          .optional(),
      field<&T::align>("align", "Whether the quantity takes part in the search for the offset."),
  });
  static constexpr auto rules = std::to_array<Rule>({needs("bias_uncertainty", "uncertainty")});
  static constexpr Type type = structure<T>("log_quantity", "A measured quantity.", fields, rules);
};

template <>
struct Described<LogMapping> {
  using T = LogMapping;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-mapping/1"),
      description_key(),
      field<&T::time>("time", ""),
      field<&T::quantities>("quantities", "The measured quantities.").items(1, 1000).required(),
  });
  static constexpr Type type = structure<T>("mapping",
                                            "Which columns of a log measure which quantities of a run, for "
                                            "`grapnel compare`.",
                                            fields);
};

namespace {

const nlohmann::ordered_json& mapping_schema_document() {
  static const nlohmann::ordered_json kSchema = schema_of(type_of<LogMapping>(), "Grapnel mapping, version 1");
  return kSchema;
}

// Uncertainties may have a unit, whose dimension is checked with the run's.
void take_uncertainties(Node& root, FaultList& faults) {
  Node* list = root.find("quantities");
  for (std::size_t i = 0; list && i < list->items.size(); ++i) {
    for (const char* key : {"uncertainty", "bias_uncertainty"}) {
      Node* value = list->items[i].find(key);
      const auto parts = value && value->is_scalar() ? number_and_unit(value->text) : std::nullopt;
      if (parts && unit_named(parts->unit))
        take_unit(*value, std::string(parts->unit), below(item("quantities", i), key), faults);
    }
  }
}

void check_mapping(const ReadMapping& read, FaultList& faults) {
  const Node& time = part(read.root, "time");
  const MappedTime& t = read.mapping.time;
  if (t.search && !((*t.search)[0] < (*t.search)[1]))
    faults.add(part(time, "search").mark, "time.search must be two increasing numbers");
  if (t.search && !std::holds_alternative<SearchedOffset>(t.offset))
    faults.add(part(time, "search").mark, "time.search has no meaning without 'offset: found'");
  const bool finds_drift = std::holds_alternative<SearchedDrift>(t.drift);
  if (finds_drift && !std::holds_alternative<SearchedOffset>(t.offset))
    faults.add(part(time, "drift").mark, "time.drift can only be found together with the offset: 'offset: found'");
  if (!finds_drift && part(time, "largest_drift").mark.source)
    faults.add(part(time, "largest_drift").mark, "time.largest_drift has no meaning without 'drift: found'");
  if (t.from && t.to && !(*t.from < *t.to)) faults.add(part(time, "to").mark, "time.to must be greater than time.from");
  for (std::size_t i = 0; i < read.mapping.quantities.size(); ++i) {
    const auto& q = read.mapping.quantities[i].axes;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (std::abs(length - 1) > 1e-6)
      faults.add(
          part(part(read.root, "quantities").items[i], "quaternion_wxyz").mark,
          fmt::format("{}.quaternion_wxyz has length {:.9g}, must be 1 within 1e-6", item("quantities", i), length));
  }
}

}  // namespace

std::optional<ReadMapping> read_mapping(const std::filesystem::path& path, FaultList& faults) {
  const std::size_t before = faults.size();
  const auto source = std::make_shared<const std::string>(path.string());
  const auto bytes = read_file(path, {source, 0, 0}, faults);
  const auto text = bytes ? checked_text(*bytes, source, faults) : std::nullopt;
  auto root = text ? parse_document(*text, source, faults) : std::nullopt;
  if (!root) return std::nullopt;
  ReadMapping read;
  read.root = std::move(*root);
  if (read.root.kind == Node::Kind::null) {
    faults.add({source, 1, 1}, "the file is empty");
    return std::nullopt;
  }
  take_uncertainties(read.root, faults);
  check_structure(read.root, mapping_schema_document(), "the mapping", faults);
  if (faults.size() != before) return std::nullopt;
  read_structure(read.root, type_of<LogMapping>(), &read.mapping);
  check_mapping(read, faults);
  return read;
}

std::string mapping_schema() { return published(mapping_schema_document()); }

}  // namespace grapnel
