/* Prints what the model says about a state. */
#include "MODEL.h"

#include <stdio.h>

static int print(const char *what, const MODEL_real *values, int count, int status)
{
    int i;
    if (status != MODEL_OK && status != MODEL_OUTSIDE) {
        fprintf(stderr, "%s: no values (status %d)\n", what, status);
        return 1;
    }
    printf("%-20s", what);
    for (i = 0; i < count; ++i)
        printf(" %12.6g", (double)values[i]);
    printf(status == MODEL_OUTSIDE ? "   outside of the data\n" : "\n");
    return 0;
}

int main(void)
{
    /* Replace these by a state and by forces of your own. */
