#include "bench/harness/robot.hpp"

#include <signal.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace arbiter::bench {

Robot::Robot(const std::string& model) {
  write_model(model);
  daemon_ = Program({program_directory() + "/arbiterd", "--instance", kInstance, "--model",
                     file("model.xml"), "--log-level", "warn"},
                    {{"XDG_RUNTIME_DIR", directory_.path()}}, file("log"));
}

Node Robot::node(const std::string& name) const {
  ::setenv("XDG_RUNTIME_DIR", directory_.path().c_str(), 1);
  NodeOptions options;
  options.instance = kInstance;
  options.on_waiting = [](const std::string&) {};  // it has just been started
  try {
    return Node(name, options);
  } catch (const Error& error) {
    throw Error(std::string(error.what()) + "\n" + log());
  }
}

void Robot::load(const std::string& model) const {
  write_model(model);
  daemon_.signal(SIGHUP);
}

std::string Robot::log() const {
  std::ifstream stream(file("log"));
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Whole or not at all: the daemon may read at any time.
void Robot::write_model(const std::string& model) const {
  std::ofstream(file("model.new")) << model;
  std::filesystem::rename(file("model.new"), file("model.xml"));
}

std::string behaviour(const std::string& source, const std::string& port, int sensed) {
  std::string condition;
  for (int i = 1; i <= sensed; ++i) {
    condition += (i == 1 ? "not /sensed" : " and not /sensed") + std::to_string(i) + ":o";
  }
  return "<behavior name=\"" + source + " to " + port + "\"><config at=\"" + port + "\">" + source +
         "</config><condition>" + condition + "</condition></behavior>\n";
}

std::string model(const std::string& behaviours, const std::string& timeout) {
  return "<behaviors timeout=\"" + timeout + "\">\n" + behaviours + "</behaviors>\n";
}

}  // namespace arbiter::bench
