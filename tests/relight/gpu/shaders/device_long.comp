#version 450
// Seconds of work on a processor: a sequence that no compiler shortens. Loops are short, since software devices end those
// of more than 65535 turns.
layout(local_size_x = 64) in;

layout(std430, binding = 1) writeonly buffer Numbers { uint numbers[]; };

void main() {
  uint number = gl_GlobalInvocationID.x + 1u;
  for (int turn = 0; turn < 60000; ++turn) {
    number ^= number << 13;
    number ^= number >> 17;
    number ^= number << 5;
  }
  numbers[gl_GlobalInvocationID.x] = number;
}
