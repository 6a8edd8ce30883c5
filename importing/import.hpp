// From the parameters of the multiplexers that people have to a model and a mapping.
//
// Neither file names anything that the other lacks, and `arbiter check` passes over both.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "importing/parameters.hpp"
#include "importing/plan.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::importing {

inline constexpr const char* kTwist = "geometry_msgs/msg/Twist";
inline constexpr const char* kTwistStamped = "geometry_msgs/msg/TwistStamped";

enum class IdleChoice { kByType, kZero, kNothing };

struct ImportOptions {
  std::string node;          // empty: the only one
  std::string name_space;    // empty: as the file says, else "/"
  std::string output_topic;  // empty: the multiplexer's own
  std::string type;          // empty: Twist, or what the file says
  IdleChoice idle = IdleChoice::kByType;
  std::optional<std::uint32_t>
      domain;  // none: that of the environment, as the multiplexers have it
};

// Both report all problems in one go. Warnings name what is dangerous in the file, notes what
// cannot be kept. The result is to be used as a whole only if no error was reported; else it says
// which way out and which types were meant, as far as that can be known, for whoever has more to
// find there. Nothing: the files do not configure such a multiplexer, which is an error.
std::optional<Plan> import_twist_mux(const std::vector<InputFile>& files,
                                     const ImportOptions& options, rules::Diagnostics& diagnostics);
std::optional<Plan> import_cmd_vel_mux(const std::vector<InputFile>& files,
                                       const ImportOptions& options,
                                       rules::Diagnostics& diagnostics);

// Comments name the lines that things come from.
std::string write_model(const Plan& plan);
std::string write_mapping(const Plan& plan, const std::string& model_name);

}  // namespace arbiter::importing
