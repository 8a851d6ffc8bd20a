// The readers of MCAP and rosbag files against arbitrary bytes, in one process: errors are std::runtime_error.
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/compare/measured_log.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::vector<std::string> requested{"/imu/data.angular_velocity.y",
                                           "imu/data.orientation",
                                           "/imu/data.orientation_covariance[2]",
                                           "/joint_states.position[elbow]",
                                           "/tf.transforms[base].translation",
                                           "header.stamp",
                                           "log_time"};
  try {
    if (grapnel::is_mcap(bytes)) grapnel::read_mcap_log(bytes, requested);
    if (grapnel::is_rosbag(bytes)) grapnel::read_bag_log(bytes, requested);
  } catch (const std::runtime_error&) {  // an error of the log
  }
  return 0;
}
