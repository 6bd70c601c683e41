#version 450
// Depth alone.
void main() {}
