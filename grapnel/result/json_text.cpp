#include "grapnel/result/json_text.hpp"

#include <algorithm>

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

void print(const Json& json, const std::string& indent, std::string& out) {
  const bool nested =
      std::any_of(json.begin(), json.end(), [](const Json& item) { return item.is_structured(); }) || json.is_object();
  if (!json.is_structured() || json.empty()) {
    out += json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  const char* brackets = json.is_object() ? "{}" : "[]";
  const std::string inner = indent + "  ";
  out += brackets[0];
  bool first = true;
  for (const auto& [key, value] : json.items()) {
    if (!first) out += nested ? "," : ", ";
    first = false;
    if (nested) out += "\n" + inner;
    if (json.is_object()) out += Json(key).dump(-1, ' ', false, Json::error_handler_t::replace) + ": ";
    print(value, inner, out);
  }
  if (nested) out += "\n" + indent;
  out += brackets[1];
}

}  // namespace

std::string json_text(const Json& document) {
  std::string text;
  print(document, "", text);
  return text + "\n";
}

}  // namespace grapnel
