// One more step in shadow.

layout(location = 0) out float steps;

void main() {
    steps = 1.0;
}
