// The texts of the model in force, for those who explain it (`arbiter why`).
//
//   {"generation": 3, "in_force_since_ns": 17000000000, "known": true,
//    "models": [{"path": "/etc/arbiter/robot.xml", "text": "<behaviors>…"}], "application": null}
//
// Not the files: they may say something else by now. Where a predecessor has read the model, its
// texts are not known; nor is the time, which then is 0.
#pragma once

#include <cstdint>
#include <optional>

#include "rules/model_texts.hpp"
#include "service/models.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// One copy for each model, made when somebody first asks: whoever asks again costs nothing.
class ModelCopy {
 public:
  // Read-only. `texts`: of the model in force, null where they are not known. Throws
  // std::system_error, std::runtime_error.
  const shm::FileDescriptor& of(const Models& models, const rules::ModelTexts* texts);

 private:
  std::optional<std::uint64_t> generation_;
  shm::FileDescriptor readable_;
};

}  // namespace arbiter::service
