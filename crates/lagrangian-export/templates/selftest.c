/* Whether this build of the model gives the values that it was exported with. */
#include "MODEL.h"

#include <stdio.h>

int main(void)
{
    const int status = MODEL_selftest();
    if (status != MODEL_OK)
        fprintf(stderr, "MODEL_selftest: status %d\n", status);
    return status == MODEL_OK ? 0 : 1;
}
