// A C++17 program: options are filled member by member.
#include <chrono>
#include <cstring>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "position.hpp"

static_assert(__cplusplus == 201703L, "this program is C++17");

int main(int, char** argv) {
  arbiter::NodeOptions node_options;
  node_options.instance = argv[1];
  node_options.connect_timeout = std::chrono::seconds(10);
  node_options.service_thread = true;
  arbiter::Node node("consumer", node_options);

  arbiter::OutputPortOptions output_options;
  output_options.max_loans = 3;
  output_options.max_size = 256;
  output_options.max_memory = std::size_t{1} << 24;
  arbiter::OutputPort<Position> out = node.output_port<Position>("/Object/pos:o", output_options);

  arbiter::InputPortOptions input_options;
  input_options.depth = 4;
  input_options.when_full = arbiter::refuse_new;
  input_options.keep = false;
  input_options.max_held = 2;
  arbiter::InputPort<Position> in = node.input_port<Position>("/Arm/pos:i", input_options);

  std::optional<arbiter::Loan<Position>> loan = out.loan();
  require(loan.has_value(), "a loan is to be had");
  (*loan)->x = 1;
  (*loan)->y = 2;
  (*loan)->z = 3;
  const arbiter::Outcome outcome = out.publish(std::move(*loan));
  require(outcome.delivered == 1 && outcome.discarded == 0 && outcome.refused == 0, "delivered");

  if (auto sample = in.take()) {
    require((**sample).x == 1 && (*sample)->z == 3, "the sample that was published");
    require(sample->source() == "/Object/pos:o" && sample->sequence() == 1, "its source");
  } else {
    require(false, "a sample waits");
  }
  require(in.winner() == std::string("/Object/pos:o") && !in.idle(), "the winner");

  out.deactivate();
  const arbiter::WaitResult<Position> idle = in.wait_for(std::chrono::hours(1));
  require(!idle && idle.idle() && idle.status() == arbiter::WaitStatus::idle, "idle");

  for (int i = 0; i < 4; ++i) require(out.publish(Position{0, 0, 0}).delivered == 1, "room");
  require(out.publish(Position{0, 0, 0}).refused == 1, "full");
  require(in.fd() >= 0, "a descriptor");

  arbiter::OutputPort<> bytes = node.output_port("/Camera/image:o", output_options);
  auto image = bytes.loan(100);
  require(image.has_value() && image->size() == 100, "a loan of bytes");
  std::memset(image->data(), 1, image->size());
  for (std::byte& each : **image) each = std::byte{2};
  bytes.publish(std::move(*image));
  const std::vector<std::byte> copied(7);
  bytes.publish(arbiter::Bytes(copied.data(), copied.size()));

  // A type that is known only at run time, and what is never late.
  require(in.type() == arbiter::Type("geometry/Position", 24, 8), "the type's name");
  require(arbiter::type_of<Position>() == out.type() && in.type() != bytes.type(), "types");
  while (in.take()) {
  }
  const arbiter::Time now = std::chrono::steady_clock::now();
  require(out.publish(Position{4, 5, 6}, now + std::chrono::hours(1)).delivered == 1, "in time");
  require(in.take()->type().name() == "geometry/Position", "a sample tells its type");
  const arbiter::Outcome late = out.publish(Position{7, 8, 9}, now - std::chrono::seconds(1));
  require(late.late && late.delivered == 0 && !in.take(), "late");
  require(out.publish_at(std::chrono::steady_clock::now(), Position{0, 1, 2}).delivered == 1,
          "at a given time");

  try {
    auto taken = node.output_port<Position>("/Object/pos:o");
    require(false, "a name is taken once");
  } catch (const arbiter::Error& error) {
    require(std::strlen(error.what()) > 20, "an error is a sentence");
  }
}
