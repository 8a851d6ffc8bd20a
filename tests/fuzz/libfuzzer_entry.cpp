// libFuzzer calls this function for every input. An uncaught exception ends the process, which reports a bug.

#include <cstddef>
#include <cstdint>

#include "fuzz/fuzz_scenario.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  grapnel::fuzz::try_input({reinterpret_cast<const char*>(data), size});
  return 0;
}
