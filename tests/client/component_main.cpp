// A component in a process of its own, told what to do line by line on standard input. It answers
// each line with one line. component.hpp speaks to it.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/samples.hpp"

namespace arbiter::test {

// main() is to return.
struct Returns {};

// They end after all static objects of the library.
std::vector<std::unique_ptr<Node>> static_nodes;

class Component {
 public:
  std::string obey(const std::string& line) {
    std::istringstream words(line);
    std::string verb;
    words >> verb;
    if (verb == "node") return node(words);
    if (verb == "static-node") return static_node(words);
    if (verb == "output") return output(words);
    if (verb == "output-that-yields") return output(words, true);
    if (verb == "input") return input(words);
    if (verb == "tap") return tap(words);
    if (verb == "images-out") return images_out(words);
    if (verb == "images-in") return images_in(words);
    if (verb == "fork") return fork_child(words);
    std::string port;
    words >> port;
    if (verb == "publish") return publish(port, words);
    if (verb == "signal") return answer(outputs_.at(port)->signal());
    if (verb == "deactivate") return outputs_.at(port)->deactivate(), "done";
    if (verb == "describe") return outputs_.at(port)->describe("a topic"), "done";
    if (verb == "take") return answer(inputs_.at(port)->take());
    if (verb == "hold") return hold(port);
    if (verb == "hold-event") return hold_event(port);
    if (verb == "held-event") return std::to_string(event_->sample()->value);
    if (verb == "watch") return watch(port);
    if (verb == "held") return std::to_string(held_.at(port)->value);
    if (verb == "give") return held_.erase(port), "done";
    if (verb == "wait") return wait(port);
    if (verb == "close") return close(port);
    if (verb == "look") return look(port);
    if (verb == "look-at-next") return image_.reset(), look(port);
    return "what?";
  }

 private:
  std::string node(std::istringstream& words) {
    std::string name;
    words >> name;
    node_ = std::make_unique<Node>(name);
    return "done";
  }
  static std::string static_node(std::istringstream& words) {
    std::string name;
    words >> name;
    static_nodes.push_back(std::make_unique<Node>(name));
    return "done";
  }
  std::string output(std::istringstream& words, bool yields = false) {
    std::string name;
    OutputPortOptions options;
    options.yields = yields;
    words >> name;
    outputs_[name] =
        std::make_unique<OutputPort<Number>>(node_->output_port<Number>(name, options));
    return "open";
  }
  std::string input(std::istringstream& words) {
    std::string name;
    InputPortOptions options;
    words >> name >> options.depth >> options.max_held >> options.keep;
    inputs_[name] = std::make_unique<InputPort<Number>>(node_->input_port<Number>(name, options));
    return "open";
  }
  std::string tap(std::istringstream& words) {
    std::string name;
    TapOptions options;
    words >> name >> options.max_held;
    taps_.insert_or_assign(name, node_->tap<Number>(name, options));
    return "open";
  }
  std::string hold_event(const std::string& port) {
    do {
      event_ = taps_.at(port).wait_for(std::chrono::hours::max());
    } while (event_->sample() == nullptr);
    return std::to_string(event_->sample()->value);
  }
  // For ever.
  std::string watch(const std::string& port) {
    for (;;) static_cast<void>(taps_.at(port).wait_for(std::chrono::hours::max()));
  }
  // A child that ends as if this component did; or one that stays, whose number it answers.
  std::string fork_child(std::istringstream& words) {
    std::string how;
    words >> how;
    int is_here[2];
    if (::pipe2(is_here, O_CLOEXEC) != 0) return "no pipe";
    const pid_t child = ::fork();
    if (child == 0) {
      ::alarm(60);
      ::close(is_here[0]);
      ::close(is_here[1]);
      if (how == "pause") ::pause();
      if (how == "exit") std::exit(0);
      throw Returns();
    }
    char nothing = 0;
    ::close(is_here[1]);
    static_cast<void>(!::read(is_here[0], &nothing, 1));  // until the child has closed it
    ::close(is_here[0]);
    if (how == "pause") return std::to_string(child);
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? "ended " + std::to_string(WEXITSTATUS(status)) : "killed";
  }
  std::string publish(const std::string& port, std::istringstream& words) {
    std::int64_t value = 0;
    std::int64_t count = 1;
    words >> value >> count;
    Outcome last;
    for (std::int64_t i = 0; i < count; ++i) last = outputs_.at(port)->publish(Number{value + i});
    return answer(last);
  }
  std::string hold(const std::string& port) {
    auto sample = inputs_.at(port)->take();
    if (!sample) return "none";
    const std::int64_t value = (*sample)->value;
    held_.insert_or_assign(port, std::move(*sample));
    return std::to_string(value);
  }
  std::string wait(const std::string& port) {
    auto result = inputs_.at(port)->wait_for(std::chrono::hours::max());
    if (result) return std::to_string((**result).value);
    return result.idle() ? "idle" : "timeout";
  }

  std::string close(const std::string& port) {
    outputs_.erase(port);
    inputs_.erase(port);
    return "closed";
  }

  std::string images_out(std::istringstream& words) {
    std::string name;
    words >> name;
    images_out_ = std::make_unique<OutputPort<Image>>(node_->output_port<Image>(name));
    return "open";
  }
  std::string images_in(std::istringstream& words) {
    std::string name;
    words >> name;
    images_in_ = std::make_unique<InputPort<Image>>(node_->input_port<Image>(name));
    return "open";
  }
  // Takes an image and keeps it, or looks at one that is held: where it lies, and what it says.
  std::string look(const std::string& byte) {
    if (!image_) image_ = images_in_->take();
    if (!image_) return "none";
    const Image& image = **image_;
    return where(&image) + " " + std::to_string(image.bytes.at(std::stoul(byte)));
  }

  static std::string answer(const Outcome& outcome) {
    return std::to_string(outcome.delivered) + " " + std::to_string(outcome.discarded) + " " +
           std::to_string(outcome.refused);
  }
  static std::string answer(const std::optional<Sample<Number>>& sample) {
    return sample ? std::to_string((*sample)->value) : "none";
  }

  std::unique_ptr<Node> node_;
  std::map<std::string, std::unique_ptr<OutputPort<Number>>> outputs_;
  std::map<std::string, std::unique_ptr<InputPort<Number>>> inputs_;
  std::map<std::string, Sample<Number>> held_;
  std::map<std::string, Tap<Number>> taps_;
  std::optional<TapEvent<Number>> event_;
  std::unique_ptr<OutputPort<Image>> images_out_;
  std::unique_ptr<InputPort<Image>> images_in_;
  std::optional<Sample<Image>> image_;
};

}  // namespace arbiter::test

int main() {
  static arbiter::test::Component component;  // for exit() to destroy
  for (std::string line; std::getline(std::cin, line);) {
    std::string answer;
    try {
      answer = component.obey(line);
    } catch (const arbiter::test::Returns&) {
      return 0;
    } catch (const std::exception& error) {
      answer = std::string("error: ") + error.what();
    }
    std::cout << answer << std::endl;
  }
}
