#version 450
// Writes only depth.
void main() {}
