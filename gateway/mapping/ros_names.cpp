#include "gateway/mapping/ros_names.hpp"

#include <algorithm>
#include <array>

namespace arbiter::gateway {
namespace {

constexpr std::string_view kMangled = "::dds_::";

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Of CDR as ROS 2 sends it (XCDR1: each number aligned to its own size, up to 8). All fields of one
// type are alike.
struct FixedType {
  std::string_view name;
  std::size_t size;
  Field field;
};
constexpr std::array<FixedType, 27> kFixedTypes{{
    {"geometry_msgs/msg/Accel", 48, Field::kF64},
    {"geometry_msgs/msg/Point", 24, Field::kF64},
    {"geometry_msgs/msg/Point32", 12, Field::kF32},
    {"geometry_msgs/msg/Pose", 56, Field::kF64},
    {"geometry_msgs/msg/Pose2D", 24, Field::kF64},
    {"geometry_msgs/msg/PoseWithCovariance", 344, Field::kF64},
    {"geometry_msgs/msg/Quaternion", 32, Field::kF64},
    {"geometry_msgs/msg/Transform", 56, Field::kF64},
    {"geometry_msgs/msg/Twist", 48, Field::kF64},
    {"geometry_msgs/msg/TwistWithCovariance", 336, Field::kF64},
    {"geometry_msgs/msg/Vector3", 24, Field::kF64},
    {"geometry_msgs/msg/Wrench", 48, Field::kF64},
    {"std_msgs/msg/Bool", 1, Field::kBoolean},
    {"std_msgs/msg/Byte", 1, Field::kU8},
    {"std_msgs/msg/Char", 1, Field::kU8},
    {"std_msgs/msg/ColorRGBA", 16, Field::kF32},
    {"std_msgs/msg/Empty", 1, Field::kU8},
    {"std_msgs/msg/Float32", 4, Field::kF32},
    {"std_msgs/msg/Float64", 8, Field::kF64},
    {"std_msgs/msg/Int16", 2, Field::kI16},
    {"std_msgs/msg/Int32", 4, Field::kI32},
    {"std_msgs/msg/Int64", 8, Field::kI64},
    {"std_msgs/msg/Int8", 1, Field::kI8},
    {"std_msgs/msg/UInt16", 2, Field::kU16},
    {"std_msgs/msg/UInt32", 4, Field::kU32},
    {"std_msgs/msg/UInt64", 8, Field::kU64},
    {"std_msgs/msg/UInt8", 1, Field::kU8},
}};

// They begin with a std_msgs/msg/Header; so do those of geometry_msgs that are called Stamped.
constexpr std::array<std::string_view, 21> kWithHeader{{
    "ackermann_msgs/msg/AckermannDriveStamped",
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/Path",
    "sensor_msgs/msg/BatteryState",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/FluidPressure",
    "sensor_msgs/msg/Illuminance",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Joy",
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/MagneticField",
    "sensor_msgs/msg/NavSatFix",
    "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/Range",
    "sensor_msgs/msg/RelativeHumidity",
    "sensor_msgs/msg/Temperature",
    "trajectory_msgs/msg/JointTrajectory",
}};

constexpr std::string_view kStamped = "Stamped";

bool is_stamped_geometry(std::string_view ros_type) {
  return ros_type.starts_with("geometry_msgs/msg/") && ros_type.ends_with(kStamped);
}

const FixedType* find_fixed(std::string_view ros_type) {
  const auto* const found =
      std::find_if(kFixedTypes.begin(), kFixedTypes.end(),
                   [&](const FixedType& each) { return each.name == ros_type; });
  return found == kFixedTypes.end() ? nullptr : found;
}

}  // namespace

bool is_ros_topic(std::string_view name) {
  if (name.size() < 2) return false;
  char before = 0;
  for (const char c : name) {
    const bool begins = before == '/';
    if (before == 0 && c != '/') return false;
    if (before != 0 && c == '/' && begins) return false;
    if (is_digit(c) && begins) return false;
    if (c != '/' && c != '_' && !is_lower(c) && !is_upper(c) && !is_digit(c)) return false;
    before = c;
  }
  return before != '/';
}

bool is_ros_type(std::string_view name) {
  const std::size_t first = name.find('/');
  const std::size_t second = first == name.npos ? first : name.find('/', first + 1);
  if (second == name.npos) return false;
  const std::string_view package = name.substr(0, first);
  const std::string_view kind = name.substr(first + 1, second - first - 1);
  const std::string_view type = name.substr(second + 1);
  if (package.empty() || !(is_lower(package[0]) || is_upper(package[0])) || type.empty())
    return false;
  if (kind != "msg" && kind != "srv" && kind != "action") return false;
  const auto is_word = [](char c) { return c == '_' || is_lower(c) || is_upper(c) || is_digit(c); };
  return is_upper(type[0]) && std::all_of(package.begin(), package.end(), is_word) &&
         std::all_of(type.begin(), type.end(), is_word);
}

bool is_dds_topic(std::string_view name) {
  return !is_digit(name.front()) && !name.starts_with("DCPS") &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return is_lower(c) || is_upper(c) || is_digit(c) || c == '_' || c == '/';
         });
}

std::string dds_topic_of(std::string_view ros_topic) { return "rt" + std::string(ros_topic); }

std::string dds_type_of(std::string_view ros_type) {
  const std::size_t last = ros_type.rfind('/');
  std::string result;
  for (const char c : ros_type.substr(0, last)) result += c == '/' ? "::" : std::string(1, c);
  return result + std::string(kMangled) + std::string(ros_type.substr(last + 1)) + "_";
}

std::string readable_type(std::string_view dds_type) {
  const std::size_t at = dds_type.find(kMangled);
  if (at == dds_type.npos || !dds_type.ends_with('_')) return std::string(dds_type);
  std::string package(dds_type.substr(0, at));
  const std::size_t colons = package.find("::");
  if (colons == std::string::npos) return std::string(dds_type);
  package.replace(colons, 2, "/");
  const std::string_view type = dds_type.substr(at + kMangled.size());
  std::string result = package + "/" + std::string(type.substr(0, type.size() - 1));
  return is_ros_type(result) ? result : std::string(dds_type);
}

std::optional<std::size_t> fixed_size_of(std::string_view ros_type) {
  const FixedType* const known = find_fixed(ros_type);
  return known == nullptr ? std::nullopt : std::optional(known->size);
}

std::optional<Field> field_of(std::string_view ros_type) {
  const FixedType* const known = find_fixed(ros_type);
  return known == nullptr ? std::nullopt : std::optional(known->field);
}

std::optional<std::size_t> size_without_frame(std::string_view ros_type) {
  // Its last three bytes align what follows, in XCDR2, too.
  constexpr std::size_t kHeader = 16;
  // A transform has a second name behind its header.
  if (!is_stamped_geometry(ros_type) || ros_type == "geometry_msgs/msg/TransformStamped") {
    return std::nullopt;
  }
  const auto body = fixed_size_of(ros_type.substr(0, ros_type.size() - kStamped.size()));
  return body ? std::optional(kHeader + *body) : std::nullopt;
}

bool has_header(std::string_view ros_type) {
  return is_stamped_geometry(ros_type) ||
         std::find(kWithHeader.begin(), kWithHeader.end(), ros_type) != kWithHeader.end();
}

bool has_strings(std::string_view ros_type) {
  return ros_type == "std_msgs/msg/String" || has_header(ros_type);
}

}  // namespace arbiter::gateway
