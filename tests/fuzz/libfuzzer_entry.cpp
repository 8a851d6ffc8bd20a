// What libFuzzer calls for every input. An exception that leaves it ends the process, which is how a bug shows.

#include <cstddef>
#include <cstdint>

#include "fuzz/fuzz_scenario.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  grapnel::fuzz::try_input({reinterpret_cast<const char*>(data), size});
  return 0;
}
