// A status that has each field, and no value twice where it could be taken for another.
#pragma once

#include "wire/status.hpp"

namespace arbiter::test {

inline wire::Status full_status() {
  wire::Status status;
  status.instance = "x";
  status.pid = 42;
  status.directory = "/home/robot";
  status.now = 16;
  status.clients = 3;
  status.model = {7,         "work",
                  2,         {"a.xml", "b.xml"},
                  "app.xml", wire::RefusedFilesStatus{{"c.xml"}, "c.xml:1:1: not so"}};
  status.models = {{"work", true, false, {"a.xml"}, "app.xml"}, {"play", false, false, {}, {}}};
  status.history = {
      {7, 5, "work", {"a.xml"}, "app.xml", 1'795'323'981'354, "reload", "robot", "none", true},
      {6, 6, "", {}, {}, -1, "start", {}, {}, false}};
  status.deaths = {{"dead", 44, 1000, 13, {"/o"}, {"/i", "/j"}, {"/i"}}};
  status.refusals = {{"out", 47, 1000, 14, "not you", "/o", {}},
                     {"in", 48, 1001, 15, "nor you", {}, "/i"}};
  status.strangers = {{"lost", 43, 1000, "its state is gone", 11, 12, {"/o"}, {"/i", "/j"}}};
  wire::SourceStatus source;
  source.name = "/face";
  source.mentioned = true;
  source.timeout = 500'000'000;
  source.open = {{"face", 44, 4'294'967'294},
                 {{"recorder", 48, 1002}},
                 wire::SampleType{"Pose", 24, 8},
                 100,
                 101,
                 102,
                 103,
                 104,
                 105,
                 106,
                 107,
                 108,
                 109,
                 "a topic",
                 true};
  wire::SourceStatus latched;
  latched.name = "/stop";
  latched.active = true;
  latched.timeout = shm::kForever;
  latched.away_pid = 45;
  wire::SourceStatus untyped;
  untyped.name = "/bytes";
  untyped.open = wire::OpenOutput{};
  status.sources = {source, latched, untyped};
  wire::InputStatus input;
  input.name = "/gaze";
  input.mentioned = input.arbitrated = input.in_order = true;
  input.winner = "/face";
  input.open = {{"gaze", 46, 1001},
                wire::SampleType{"Point", 16, 4},
                4,
                true,
                wire::WhenFull::kRefuseNew,
                201,
                202,
                203,
                204,
                205,
                206,
                207,
                "another topic",
                true};
  wire::ConnectionStatus connection{
      "/face", true, true, wire::End::kOpen, wire::End::kOpen, {}, 4, 301, 302, 303, 304,
      305,     306,  307};
  input.connections = {connection};
  input.connections.push_back(
      {"/bytes", false, false, wire::End::kOpen, wire::End::kOpen, "no", {}, 0, 0, 0, 0, 0, 0, 0});
  input.connections.push_back(
      {"/stop", false, false, wire::End::kAway, wire::End::kOpen, {}, {}, 0, 0, 0, 0, 0, 0, 0});
  input.senses = {{"/stop", true}};
  wire::InputStatus idle;
  idle.name = "/idle";
  idle.idle = true;
  idle.cannot_deliver = {"/stop", "nobody has it open"};
  idle.away_pid = 47;
  status.inputs = {input, idle};
  return status;
}

}  // namespace arbiter::test
