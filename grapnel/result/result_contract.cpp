#include "grapnel/result/result_contract.hpp"

#include "grapnel/result/result_fields.hpp"
#include "grapnel/result/scene_fields.hpp"

namespace grapnel {

std::span<const ResultContract> result_contracts() {
  static constexpr ResultContract all[] = {{"summary", "Grapnel summary, version 2", &type_of<Summary>},
                                           {"scene", "Grapnel scene, version 1", &type_of<SceneDocument>}};
  return all;
}

const ResultContract* result_contract(std::string_view kind) {
  for (const ResultContract& one : result_contracts()) {
    if (one.kind == kind) return &one;
  }
  return nullptr;
}

}  // namespace grapnel
