// Only depth and stencil are touched.

void main() {
}
