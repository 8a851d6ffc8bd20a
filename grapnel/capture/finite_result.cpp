#include "grapnel/capture/finite_result.hpp"

#include <cmath>
#include <optional>

#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// The path from a value to its first non-finite number: "" if it is the number itself.
using Path = std::optional<std::string>;

Path path_in(const Type& type, const void* value, bool also_unknown);

// By its name if it has one: "[left]".
std::string place_of(const Type& type, const void* item, std::size_t i) {
  std::string name = std::to_string(i);
  if (!type.fields.empty() && type.fields[0].type().kind == Type::Kind::text) {
    const auto take = [&](const void* text) { name = *static_cast<const std::string*>(text); };
    type.fields[0].show(item, visitor_of(take));
  }
  return "[" + name + "]";
}

Path path_in_list(const Type& type, const void* list, bool also_unknown) {
  const Type& of = type.of();
  Path found;
  double squares = 0;
  for (std::size_t i = 0; i < type.size(list) && !found; ++i) {
    const auto look = [&](const void* item) {
      if (of.kind == Type::Kind::real) {
        const double x = *static_cast<const double*>(item);
        squares += x * x;
        if (type.fixed_size != 3 && !std::isfinite(x)) found = "";
      } else if (const Path below = path_in(of, item, also_unknown)) {
        found = place_of(of, item, i) + *below;
      }
    };
    type.show_item(list, i, visitor_of(look));
  }
  return !found && type.fixed_size == 3 && !std::isfinite(squares) ? Path("") : found;
}

Path path_in_structure(const Type& type, const void* owner, bool also_unknown) {
  Path found;
  for (const Field& field : type.fields) {
    // derived fields follow from the others
    if (!field.place || (field.is_present && !field.is_present(owner))) continue;
    if (field.is_null_absent && !also_unknown) continue;
    const auto look = [&](const void* value) {
      if (const Path below = path_in(field.type(), value, also_unknown)) found = "." + std::string(field.key) + *below;
    };
    field.show(owner, visitor_of(look));
    if (found) break;
  }
  return found;
}

Path path_in(const Type& type, const void* value, bool also_unknown) {
  switch (type.kind) {
    case Type::Kind::real:
      return std::isfinite(*static_cast<const double*>(value)) ? Path() : Path("");
    case Type::Kind::list:
      return path_in_list(type, value, also_unknown);
    case Type::Kind::structure:
      return path_in_structure(type, value, also_unknown);
    case Type::Kind::optional: {
      Path found;
      const auto look = [&](const void* item) { found = path_in(type.of(), item, also_unknown); };
      if (type.size(value) == 1) type.show_item(value, 0, visitor_of(look));
      return found;
    }
    default:
      return {};
  }
}

// Keeps the first.
class Finder {
 public:
  template <class T>
  void look(const char* key, const T& value, bool also_unknown = false) {
    if (!found_.empty()) return;
    if (const Path path = path_in(type_of<T>(), &value, also_unknown)) found_ = key + *path;
  }
  const std::string& found() const { return found_; }

 private:
  std::string found_;
};

}  // namespace

std::string first_not_finite(const CaptureResult& result) {
  Finder finder;
  finder.look("approach.start", result.approach_start);
  finder.look("approach.end", result.approach_end);
  finder.look("capture.grasps", result.grasps, true);  // in a run that reached its end, all values are known
  finder.look("impact", result.impact);
  finder.look("later_impacts", result.later_impacts);
  finder.look("phases", result.phases);
  finder.look("post_impact.end", result.post_impact_end);
  finder.look("post_impact.grasp_loads", result.grasp_loads);
  finder.look("post_impact.detumbling", result.detumbling);
  finder.look("post_impact.base_keeping", result.base_keeping);
  finder.look("approach.impedance", result.approach_impedance);
  finder.look("post_impact.impedance", result.impedance);
  finder.look("post_impact.grasp_force", result.grasp_force);
  for (const WheelReport& wheel : result.wheels) finder.look("wheels.rate_after", wheel.rate_after);
  if (result.gyros) finder.look("gyros.least_singularity_measure", result.gyros->least_singularity_measure);
  finder.look("joints", result.joints);
  finder.look("stop_impacts", result.stop_impacts);
  if (result.thrusters) finder.look("thrusters.propellant", result.thrusters->propellant);
  finder.look("ledger.scale", result.ledger.scale);
  return finder.found();
}

}  // namespace grapnel
