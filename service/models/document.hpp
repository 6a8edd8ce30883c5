// The texts of the model in force, for those who explain it (`arbiter why`).
//
//   {"generation": 3, "name": "work", "as_loaded": true, "how": "switch",
//    "by": "node \"arbiter-switch\" (pid 7), …", "in_force_since_ns": 17000000000,
//    "known": true, "directory": "/etc/arbiter",
//    "models": [{"path": "robot.xml", "text": "<behaviors>…"}], "application": null,
//    "ports_since_ns": {"/Arm/pos:i": 9000000000},
//    "timeouts_before": {"/Face/pos:o": {"timeout_ns": 500000000, "until_ns": 17000000000,
//                                         "word": 17400000000}},
//    "others": [{"name": "rest", "ports": {"/Arm/pos:i": ["/Rest/pos:o"]}}]}
//
// Not the files: they may say something else by now; paths are meant from `directory`. Where a
// predecessor has read the model, its texts are not known; nor is the time, which then is 0.
// Of the models that could be switched to, which connections they have; of the ports that an
// earlier model decided alike, since when; of sources whose T was another, which, until when, and
// the activity's word of then: while it stands, the last arrival came under that T. `as_loaded` is
// false where the files were read again after the model in force was: it has been rolled back to.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rules/model/model_texts.hpp"
#include "service/models/board.hpp"
#include "service/models/continuity.hpp"
#include "service/models/history.hpp"
#include "service/models/library.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

struct ModelDocumentOf {
  const Board& models;
  const Library& library;
  const ModelPointer& model;  // in force; null: none, or a predecessor's
  const History& history;
  const Continuity& continuity;
};

// What relative paths are meant from; empty where it is gone.
[[nodiscard]] std::string working_directory();

// One copy for each model, made when somebody first asks: whoever asks again costs nothing.
class ModelDocument {
 public:
  // Read-only. Throws std::system_error, std::runtime_error.
  const shm::FileDescriptor& of(const ModelDocumentOf& of);

 private:
  std::optional<std::uint64_t> generation_;
  shm::FileDescriptor readable_;
};

}  // namespace arbiter::service
