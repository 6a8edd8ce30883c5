// How the model in force is told: in words and as JSON.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "evidence/records.hpp"
#include "shm/activity.hpp"
#include "watch/model_in_force.hpp"

namespace arbiter::cli {

// " (switch, by node …)", empty where it is not known.
std::string how_text(const watch::ModelInForce& model);
// `model 2 "work" came into force (switch, by root)`, as it was recorded.
std::string news_text(const evidence::ModelChange& model);
// ", in force for 3.2 s (switch, by node …)"
std::string origin_text(const watch::ModelInForce& model, shm::Nanoseconds now);
// What to say of a file of the model, behind its name; empty where it is as it was read.
std::string file_advice(watch::FileNow::State state, bool is_older);
// With what has become of its files.
nlohmann::json model_json(const watch::ModelInForce& model);

}  // namespace arbiter::cli
